// "Save as a picture": draws the card on a canvas of 1200 x 630 px, twice as fine, and saves it as a PNG.
(function () {
  "use strict";
  const card = document.querySelector(".card"), button = document.querySelector(".save");
  if (!card || !button) return;
  const wide = 1200, high = 630, rim = 44;

  function draw() {
    const canvas = document.createElement("canvas"), style = getComputedStyle(document.documentElement);
    canvas.width = 2 * wide;
    canvas.height = 2 * high;
    const pen = canvas.getContext("2d"), colour = (name) => style.getPropertyValue("--" + name).trim();
    const words = (selector, from) => ((from || document).querySelector(selector) || {}).textContent || "";
    pen.scale(2, 2);
    pen.fillStyle = colour("ground");
    pen.fillRect(0, 0, wide, high);

    function write(text, x, y, size, name, width, most, bold) { // returns y of the next line
      pen.font = (bold ? "600 " : "") + size + "px system-ui, sans-serif";
      pen.fillStyle = colour(name);
      const lines = [""];
      for (const word of text.trim().split(/[ \n]+/)) {
        const longer = (lines[lines.length - 1] + " " + word).trim();
        if (pen.measureText(longer).width <= width || !lines[lines.length - 1]) lines[lines.length - 1] = longer;
        else lines.push(word);
      }
      if (lines.length > most) lines.splice(most, lines.length, lines.splice(most - 1)[0] + " …");
      for (const line of lines) pen.fillText(line, x, (y += 1.25 * size), width);
      return y;
    }

    const inner = wide - 2 * rim;
    let top = write(words(".kicker"), rim, 20, 17, "faint", inner, 1);
    top = write(words("h1"), rim, top + 4, 36, "ink", inner, 2, true) + 24;
    const low = high - 112, left = 700, picture = image();
    if (picture) {
      const [drawing, w, h] = picture, scale = Math.min(left / w, (low - top) / h);
      pen.drawImage(drawing, rim + (left - w * scale) / 2, top + (low - top - h * scale) / 2, w * scale, h * scale);
    }
    let y = top - 8;
    for (const tile of card.querySelectorAll(".tiles > div")) {
      const x = rim + left + 28, room = wide - rim - x;
      y = write(words("dt", tile), x, y, 17, "faint", room, 1);
      y = write(words("data", tile), x, y, 30, "ink", room, 1, true);
      y = write(words("small", tile), x, y, 15, "faint", room, 3) + 14;
    }
    write(words(".mill"), rim, low + 4, 17, "ink", inner, 2);
    write(words(".checks"), rim, high - 50, 15, "faint", inner, 1);
    return canvas;
  }

  function image() { // what the player shows now, else the still picture
    const live = card.querySelector(".mp-live .mp-canvas"), still = card.querySelector("img[src]");
    const player = live && (window.millPlayers || []).find((one) => one.view);
    if (player) {
      player.view.draw(); // a WebGL canvas keeps its picture only until the browser has shown it
      return [live, live.width, live.height];
    }
    return still ? [still, still.naturalWidth, still.naturalHeight] : null;
  }

  button.hidden = false;
  button.addEventListener("click", function () {
    draw().toBlob(function (blob) {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = button.dataset.name;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  });
})();
