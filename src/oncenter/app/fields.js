"use strict";
function clearSaid(field) {
  part(`${field}-said`).textContent = "";
  part(`${field}-said`).classList.remove("wrong");
  part(field).removeAttribute("aria-invalid");
}

// Each number of the page is read back as soon as it is typed, with a sentence where it is wrong or unusual.
for (const field of ["name", "wheelbase_m", "steering_ratio", "limit", "applied"]) {
  const input = part(field), said = part(`${field}-said`);
  input.addEventListener("change", async () => {
    clearSaid(field);
    const written = input.value.trim();
    if (field === "name" || !written) return;
    const {read, unusual, wrong} = await send("POST", "/fields", {field, written}).catch(({message}) => ({wrong: message}));
    if (input.value.trim() !== written) return; // typed on meanwhile
    said.textContent = wrong ?? [`${texts.taken_as} ${read}.`, unusual].join(" ");
    said.classList.toggle("wrong", !!wrong);
    if (wrong) input.setAttribute("aria-invalid", "true");
  });
}

// A list of names has no pictures: the layout of the chosen truck stands below it.
part("truck").addEventListener("change", () => {
  const {axles} = part("truck").selectedOptions[0].dataset;
  part("layout").toggleAttribute("hidden", !axles);
  part("layout").firstElementChild.setAttribute("href", `#axles-${axles}`);
});
