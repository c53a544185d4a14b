// A problem shown to a person: what is wrong, and what to do about it.

/** Fills `element` with the problem's message and remedy and shows it; hides it without a problem. */
export function showProblem(element, problem) {
  element.hidden = !problem;
  element.replaceChildren();
  if (!problem) return;
  const [what, then] = messageOf(problem);
  element.append(node("strong", what), ...(then ? [node("span", then)] : []));
  if (problem.code) element.dataset.code = problem.code;
}

function messageOf(problem) {
  const what = problem.detail || problem.message || problem.title || "Something went wrong.";
  const remedy = problem.remedy ?? "";
  // Some messages end in their remedy already.
  if (remedy && what.endsWith(remedy)) return [what.slice(0, -remedy.length).trim(), remedy];
  return [what, remedy];
}

function node(tag, text) {
  const element = document.createElement(tag);
  element.textContent = text;
  return element;
}
