// A question before what cannot be taken back.
import { useEffect, useRef } from "preact/hooks";
import { said } from "./words";

export interface Question {
  title: string;
  about: string;
  yes: string;
  then(): void;
}

export function Confirm({ question, close }: { question: Question; close(): void }) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => dialog.current?.showModal(), []);
  return (
    <dialog ref={dialog} class="confirm" aria-labelledby="confirm-title" aria-describedby="confirm-about" onClose={close}>
      <h2 id="confirm-title">{question.title}</h2>
      <p id="confirm-about">{question.about}</p>
      <div class="choices">
        <button type="button" onClick={close}>{said("cancel")}</button>
        <button type="button" class="grave" onClick={() => (close(), question.then())}>{question.yes}</button>
      </div>
    </dialog>
  );
}
