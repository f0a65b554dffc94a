// Says what is missing where the page's own script has not been made.
addEventListener("load", () => {
  setTimeout(() => {
    if (document.documentElement.dataset.begun) return;
    document.getElementById("trouble").textContent =
      "The script of this page is not there. It is made at set-up from packages of npm: with a connection to npm's registry, " +
      "run `make web` where VISTEL is installed, then load this page again. Everything else works.";
  }, 500);
});
