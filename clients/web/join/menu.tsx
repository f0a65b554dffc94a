// A button that shows others above it: those that are used now and then leave the room in sight.
import type { ComponentChildren } from "preact";

/** It closes once one of them is pressed, by Escape, and when another menu is opened. */
export function Menu({ id, label, children }: { id: string; label: string; children: ComponentChildren }) {
  const close = (menu: HTMLDetailsElement) => {
    menu.open = false;
  };
  return (
    <details id={id} class="menu" name="menu"
      onClick={(event) => (event.target as Element).closest("button, .button") && close(event.currentTarget)}
      onKeyDown={(event) => event.key === "Escape" && close(event.currentTarget)}
    >
      <summary>{label}</summary>
      <div role="group" aria-label={label}>{children}</div>
    </details>
  );
}
