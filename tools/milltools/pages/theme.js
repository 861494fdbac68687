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
