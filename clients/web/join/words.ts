// What the page says.
import { phrases } from "../console/language";

const ENGLISH = {
  welcome: "Welcome, {0}",
  choose:
    "You will sit at the table as one of these people. Choosing one starts the sound. What is sent is what you do here with mouse and keys, and your voice once you turn your microphone on.",
  ready: "{0} is ready at once; others may take some seconds to be seen.",
  hold: "Hold the left button on a thing to take it, on a person to touch them; the wheel brings the hand nearer or farther. Drag elsewhere to look round.",
  soundOn: "Sound is on",
  soundOff: "Sound is off",
  cannotHear: "This browser cannot play voices; all else works.",
  volume: "Volume",
  level: "How loud you are",
  mic_off: "Turn microphone on",
  mic_asking: "Asking for the microphone",
  mic_on: "Microphone is on",
  mic_muted: "Microphone is muted",
  mic_refused: "The browser refuses the microphone: allow it beside the address, then try again.",
  mic_none: "No microphone is there: plug one in, then try again.",
  mic_lost: "The microphone was unplugged: plug it in, then try again.",
  mic_cannot: "This browser cannot send your voice from this page; all else works.",
  muted: "The host has muted you",
  chat: "Chat",
  noLines: "Nobody has written yet.",
  write: "Write to all",
  send: "Send",
  unread: "{0} not read",
  test: "Speak: the bar shows whether you are heard.",
  noInvitation: "This address has no invitation in it. Open the whole link that the host has sent you.",
  noPicture: "This browser has no WebGL 2, without which there is no picture of the room.",
  again: "Nothing comes; trying again.",
  over: "The conference has ended. This page waits for the next one.",
  other: "日本語",
  wave: "Wave",
  nod: "Nod",
  shake: "Shake head",
  point: "Point",
  thumb: "Thumb up",
  clap: "Clap",
};
type Key = keyof typeof ENGLISH;
const JAPANESE: Record<Key, string> = {
  welcome: "{0}さん、ようこそ",
  choose:
    "次の人物のひとりとしてテーブルに着きます。選ぶと音が出ます。送られるのは、ここでのマウスとキーの操作と、マイクを入れたあとのあなたの声だけです。",
  ready: "{0} はすぐに使えます。ほかの人物は見えるまで数秒かかることがあります。",
  hold: "物の上で左ボタンを押し続けると手に取り、人の上では触れます。ホイールで手を近づけたり遠ざけたりします。ほかの場所をドラッグすると見回せます。",
  soundOn: "音：オン",
  soundOff: "音：オフ",
  cannotHear: "このブラウザーは声を再生できません。ほかの機能は使えます。",
  volume: "音量",
  level: "あなたの声の大きさ",
  mic_off: "マイクを入れる",
  mic_asking: "マイクの許可を求めています",
  mic_on: "マイク：オン",
  mic_muted: "マイク：ミュート",
  mic_refused: "ブラウザーがマイクを許可していません。アドレスの横で許可してから、もう一度押してください。",
  mic_none: "マイクがありません。つないでから、もう一度押してください。",
  mic_lost: "マイクが外れました。つないでから、もう一度押してください。",
  mic_cannot: "このブラウザーはこのページから声を送れません。ほかの機能は使えます。",
  muted: "主催者があなたをミュートしています",
  chat: "チャット",
  noLines: "まだ誰も書いていません。",
  write: "全員に書く",
  send: "送信",
  unread: "未読 {0} 件",
  test: "話してみてください。声が届いていればバーが動きます。",
  noInvitation: "このアドレスには招待が含まれていません。主催者から届いたリンク全体を開いてください。",
  noPicture: "このブラウザーには WebGL 2 がないため、部屋を表示できません。",
  again: "何も届きません。再接続しています。",
  over: "会議は終わりました。このページは次の会議を待ちます。",
  other: "English",
  wave: "手を振る",
  nod: "うなずく",
  shake: "首を振る",
  point: "指さす",
  thumb: "親指を立てる",
  clap: "拍手",
};

export const text = phrases(ENGLISH, JAPANESE);

/** What the connection says, which knows no languages. */
export function translated(said: string | null): string | null {
  const key = (Object.keys(ENGLISH) as Key[]).find((k) => ENGLISH[k] === said);
  return key ? text(key) : said;
}
