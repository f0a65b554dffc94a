// In which language a page speaks: the browser's, or the one that was chosen.
const STORED = "vistel-language";

let language = localStorage.getItem(STORED) ?? (navigator.language.startsWith("ja") ? "ja" : "en");
document.documentElement.lang = language;

export function speaksJapanese(): boolean {
  return language === "ja";
}

export function switchLanguage(): void {
  language = language === "ja" ? "en" : "ja";
  localStorage.setItem(STORED, language);
  document.documentElement.lang = language;
}

/** What gives a phrase by its name, with what belongs in the places {0}, {1}. */
export function phrases<Key extends string>(english: Record<Key, string>, japanese: Record<Key, string>) {
  return (key: Key, ...given: (string | number)[]): string =>
    given.reduce<string>((said, each, n) => said.replace(`{${n}}`, () => String(each)), (language === "ja" ? japanese : english)[key]);
}
