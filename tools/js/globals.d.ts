// What scripts of pages find there besides each other. What the template has made is of the right kind.
declare const MillThree: any; // player/vendor

interface Window {
  millPlayers: any[];
  millStudio: any;
  millStudy: any;
}
interface ParentNode {
  querySelector(selectors: string): any;
  querySelectorAll(selectors: string): NodeListOf<any>;
}
interface Document {
  getElementById(id: string): any;
}
