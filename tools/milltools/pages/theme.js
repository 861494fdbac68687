(function () {
  "use strict";
  const root = document.documentElement, choice = document.getElementById("theme");
  function show(theme) {
    if (theme === "light" || theme === "dark") root.dataset.theme = theme;
    else delete root.dataset.theme;
  }
  choice.parentElement.hidden = false;
  choice.addEventListener("change", function () {
    show(choice.value);
    document.dispatchEvent(new Event("themechange"));
  });
})();
// paper shows what is folded
(function () {
  "use strict";
  let folded = [];
  addEventListener("beforeprint", function () {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const one of folded) one.open = true;
  });
  addEventListener("afterprint", function () {
    for (const one of folded) one.open = false;
  });
})();
