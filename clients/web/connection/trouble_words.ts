// What the connection says, in the language of the page.
import { phrases } from "../console/language";
import { TROUBLE } from "./trouble";

type Key = keyof typeof TROUBLE;
const JAPANESE: Record<Key, string> = {
  again: "何も届きません。再接続しています。",
  over: "会議は終わりました。このページは次の会議を待ちます。",
};
const text = phrases(TROUBLE, JAPANESE);

/** What is none of these stays as it is, such as why a link is refused. */
export function translated(said: string | null): string | null {
  const key = (Object.keys(TROUBLE) as Key[]).find((k) => TROUBLE[k] === said);
  return key ? text(key) : said;
}
