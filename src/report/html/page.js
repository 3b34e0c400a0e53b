const { tables, plots, spaces } = JSON.parse(document.getElementById("drawings").textContent);
let drawn = [];

function drawAll() {
  drawn.forEach((d) => d.destroy());
  drawn = [];
  document.querySelectorAll(".space").forEach((place, i) => drawn.push(drawSpace(place, spaces[i], tables)));
  document.querySelectorAll(".plot").forEach((place, i) => drawn.push(drawPlot(place, plots[i], tables)));
  // for whoever opens the page by a program
  document.documentElement.dataset.drawn = drawn.length;
}

function fitAll() {
  drawn.forEach((d) => d.fit());
}

let width = document.body.clientWidth;
addEventListener("resize", () => {
  if (document.body.clientWidth === width) return;
  width = document.body.clientWidth;
  fitAll();
});

// colours are those of the moment
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

// paper has a width of its own, and is white
function onPaper(isPaper) {
  document.documentElement.classList.toggle("paper", isPaper);
  drawAll();
}
addEventListener("beforeprint", () => onPaper(true));
addEventListener("afterprint", () => onPaper(false));

drawAll();
