"use strict";
const token = document.querySelector("meta[name=token]").content;
const one = (selector, inside = document) => inside.querySelector(selector);

async function send(address, body, section) {
  const told = one(".told", section);
  told.textContent = "";
  let error = "the page was ended: start pamrs studio again";
  try {
    const answer = await fetch(address, { method: "POST", body, headers: { "X-Pamrs-Token": token } });
    error = answer.ok ? "" : (await answer.text());
    try { error = JSON.parse(error).error || error; } catch { /* it was plain text */ }
  } catch { /* no answer */ }
  told.textContent = error;
  return !error;
}

function confirmed() {
  return [...document.querySelectorAll(".log")].map((log) => {
    const columns = {};
    for (const row of log.querySelectorAll("tr[data-column]")) {
      const channel = one(".channel", row);
      if (channel) columns[row.dataset.column] = [channel.value, one(".unit", row).value.trim()];
    }
    const spacing = one(".spacing", log);
    return { role: one(".role", log).value, sample_time: spacing ? spacing.value : "", columns };
  });
}

const bodies = {
  packaged: () => ({ name: one("#packaged").value }),
  rig: () => ({ text: one("#rigtext").value }),
  case: () => ({ text: one("#casetext").value }),
  confirm: () => ({ logs: confirmed() }),
};

function anew(section) {
  location.hash = section.id;
  location.reload();
}

for (const button of document.querySelectorAll("button[data-do]")) {
  button.addEventListener("click", async () => {
    const section = button.closest("section"), what = button.dataset.do;
    button.disabled = true;
    button.setAttribute("aria-busy", "true");
    const body = JSON.stringify(bodies[what] ? bodies[what]() : {});
    if (await send(`/${what}`, body, section)) anew(section);
    else {
      button.disabled = false;
      button.removeAttribute("aria-busy");
    }
  });
}

one("#rigfile").addEventListener("change", async (event) => {
  const section = one("#rig"), text = await event.target.files[0].text();
  if (await send("/rig", JSON.stringify({ text }), section)) anew(section);
});

async function upload(files) {
  const section = one("#data"), errors = [];
  for (const file of files) {
    one("#drop").firstChild.textContent = `Sending ${file.name} ... `;
    if (file.size > Number(one("#logs").dataset.most)) {
      errors.push(`${file.name}: more than ${one("#logs").dataset.most / 1048576} MB; cut it into parts`);
      continue;
    }
    const good = await send(`/upload?name=${encodeURIComponent(file.name)}`, file, section);
    if (!good) errors.push(one(".told", section).textContent);
  }
  if (!errors.length) return anew(section);
  one("#drop").firstChild.textContent = "Drop logs here, or choose them ";
  one(".told", section).textContent = `${errors.join("; ")}. What was taken is shown when the page is loaded anew.`;
}
// what is dropped beside it must not take the place of the page
for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());
const drop = one("#drop");
one("#logs").addEventListener("change", (event) => upload([...event.target.files]));
for (const name of ["dragover", "dragleave", "drop"]) {
  drop.addEventListener(name, (event) => {
    event.preventDefault();
    drop.classList.toggle("over", name === "dragover");
    if (name === "drop") upload([...event.dataTransfer.files]);
  });
}

// another channel is proposed in the unit that people read it in, where none was said
for (const channel of document.querySelectorAll(".channel")) {
  channel.addEventListener("change", () => {
    const unit = one(".unit", channel.closest("tr"));
    if (!unit.value && channel.value) unit.value = channel.selectedOptions[0].dataset.unit;
  });
}

let lost = 0; // answers that did not come, one after the other

async function poll() {
  try {
    const told = await (await fetch("/progress")).json();
    if (!told.running) return anew(one(told.error ? "#run" : "#result"));
    one("progress").value = told.share;
    one("#left").textContent = `${Math.round(100 * told.share)} %${told.left ? `, ${told.left}` : ""}`;
    one("#leading").replaceChildren(...told.leading.map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    }));
    one("#lines").textContent = told.lines.join("\n");
    lost = 0;
  } catch {
    lost += 1;
    if (lost > 4) {
      one("#left").textContent = "the page was ended: start pamrs studio again";
      return;
    }
  }
  setTimeout(poll, 1000);
}
if (document.body.dataset.running === "yes") poll();
