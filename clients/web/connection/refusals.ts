// Why something was refused, in the language of the page, for what users meet most.
import { phrases } from "../console/language";

const ENGLISH = {
  link_gone: "This link does not count, or does no longer: there may be a newer one. Ask the host for a link.",
  link_ended: "This invitation has ended. Ask the host for a new link.",
  seat_gone: "The conference has no such seat any more. Ask the host for a new link.",
  site_off: "The site of the guests does not run on the console’s machine now. Tell the host.",
  unreadable: "The host’s machine cannot read its invitations; its log says why.",
  may_not: "Only who has the host’s token may steer; it is host_token under [console] of the conference file.",
  busy: "Too much at once; wait for the answers.",
  no_run: "No vistel up answers; only what it started can be steered so.",
  no_world: "No world is at {0}; there are {1}.",
  no_participant: "No participant is called {0}.",
  no_microphone: "{0} has no microphone.",
  not_muted: "The sound of {0} does not say that {1} is muted. Is it running?",
  guest_name: "A guest’s name has 1 to {0} letters.",
  no_seat_free: "No seat for guests is free; remove a guest, or give participants of the file guest = true.",
  no_guest: "{0} is no guest: only who came by a link can be removed.",
  nobody_invited: "Nobody is invited to the seat {0}.",
};
type Key = keyof typeof ENGLISH;
const JAPANESE: Record<Key, string> = {
  link_gone: "このリンクは無効か、もう使えません。新しいリンクがあるかもしれません。主催者に聞いてください。",
  link_ended: "この招待は終わりました。新しいリンクを主催者に頼んでください。",
  seat_gone: "会議にその席はもうありません。新しいリンクを主催者に頼んでください。",
  site_off: "ゲストの拠点は今、コンソールのマシンで動いていません。主催者に伝えてください。",
  unreadable: "主催者のマシンが招待を読めません。理由はそのログにあります。",
  may_not: "操作できるのは主催者のトークンを持つ人だけです。会議ファイルの [console] の host_token です。",
  busy: "一度に多すぎます。返答を待ってください。",
  no_run: "vistel up が応答しません。それが起動したものだけをこうして操作できます。",
  no_world: "{0} にワールドはありません。あるのは {1} です。",
  no_participant: "{0} という参加者はいません。",
  no_microphone: "{0} にはマイクがありません。",
  not_muted: "{0} の音声から、{1} をミュートしたという返答がありません。動いていますか。",
  guest_name: "ゲストの名前は 1～{0} 文字です。",
  no_seat_free: "空いているゲスト席がありません。ゲストを退席させるか、会議ファイルの参加者に guest = true を書いてください。",
  no_guest: "{0} はゲストではありません。退席させられるのは、リンクで来た人だけです。",
  nobody_invited: "{0} の席には誰も招待されていません。",
};
const text = phrases(ENGLISH, JAPANESE);

/** why: the server's code, of which not all are known here; otherwise: what it says itself, in English. */
export function refusal(why: string | undefined, values: readonly string[] | undefined, otherwise: string): string {
  return why && Object.hasOwn(ENGLISH, why) ? text(why as Key, ...(values ?? [])) : otherwise;
}
