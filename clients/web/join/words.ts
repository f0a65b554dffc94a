// What the page says, in the browser's language or the one that was chosen.
const STORED = "vistel-language";
const ENGLISH = {
  welcome: "Welcome, {0}",
  choose:
    "You will sit at the table as one of these people. Choosing one starts the sound. What is sent is what you do here with mouse and keys, your voice once you turn your microphone on, and points of your body, without pictures, once you turn your camera on.",
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
  cam_off: "Use my camera",
  cam_asking: "Asking for the camera",
  cam_loading: "The camera begins",
  cam_on: "Camera is on",
  cam_refused: "The browser refuses the camera: allow it beside the address, then try again.",
  cam_none: "No camera is there: plug one in, then try again.",
  cam_lost: "The camera was unplugged: plug it in, then try again. Mouse and keys go on.",
  cam_cannot: "The camera cannot be used here (this browser, or the host's machine lacks what finds people in pictures); mouse and keys go on.",
  cam_fetches: "What finds you in pictures is being fetched: 30 MB, once.",
  cam_raise: "Sit upright, look at the camera, and raise both hands beside your head: {0} s",
  cam_seen: "Your figure does what you do.",
  cam_slow: "This machine needs {0} s for each picture: your figure follows late.",
  cam_again: "Measure me again",
  cam_stays: "Pictures never leave this browser: only points of your body, hands and face are sent.",
  note_dark: "The picture is black: is the camera covered? Your figure rests.",
  note_nobody: "Nobody is in the picture. Your figure rests.",
  note_half: "You are half out of the picture: head and both shoulders should be in it.",
  note_light: "Your face is not found: the light is behind you, or you look away.",
  note_other: "Somebody else is in the picture: only one person should be. Your figure rests until it is clear.",
  note_hidden: "This page was in the background, where nothing is seen; your figure rested.",
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
    "次の人物のひとりとしてテーブルに着きます。選ぶと音が出ます。送られるのは、ここでのマウスとキーの操作、マイクを入れたあとのあなたの声、カメラを入れたあとの体の点（映像ではありません）だけです。",
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
  cam_off: "カメラを使う",
  cam_asking: "カメラの許可を求めています",
  cam_loading: "カメラを始めています",
  cam_on: "カメラ：オン",
  cam_refused: "ブラウザーがカメラを許可していません。アドレスの横で許可してから、もう一度押してください。",
  cam_none: "カメラがありません。つないでから、もう一度押してください。",
  cam_lost: "カメラが外れました。つないでから、もう一度押してください。マウスとキーは使えます。",
  cam_cannot: "ここではカメラを使えません（このブラウザーか、主催者のマシンに人を見つける部品がありません）。マウスとキーは使えます。",
  cam_fetches: "映像から人を見つける部品を取得しています（30 MB、一度だけ）。",
  cam_raise: "背筋を伸ばして座り、カメラを見て、両手を頭の横に上げてください：{0} 秒",
  cam_seen: "あなたの動きが人物に伝わっています。",
  cam_slow: "このマシンは一枚の映像に {0} 秒かかります。人物は遅れて動きます。",
  cam_again: "もう一度測る",
  cam_stays: "映像はこのブラウザーの外に出ません。送られるのは体、手、顔の点だけです。",
  note_dark: "映像が真っ暗です。カメラが覆われていませんか。人物は休みます。",
  note_nobody: "映像に誰もいません。人物は休みます。",
  note_half: "体が映像からはみ出しています。頭と両肩が入るようにしてください。",
  note_light: "顔が見つかりません。逆光か、横を向いています。",
  note_other: "映像にほかの人がいます。ひとりだけで映ってください。はっきりするまで人物は休みます。",
  note_hidden: "このページは背面にあり、何も見えていませんでした。人物は休んでいました。",
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

let language = localStorage.getItem(STORED) ?? (navigator.language.startsWith("ja") ? "ja" : "en");
document.documentElement.lang = language;

export function switchLanguage(): void {
  language = language === "ja" ? "en" : "ja";
  localStorage.setItem(STORED, language);
  document.documentElement.lang = language;
}

export function text(key: Key, ...given: string[]): string {
  return given.reduce((said, each, n) => said.replace(`{${n}}`, each), (language === "ja" ? JAPANESE : ENGLISH)[key]);
}

/** What the connection says, which knows no languages. */
export function translated(said: string | null): string | null {
  const key = (Object.keys(ENGLISH) as Key[]).find((k) => ENGLISH[k] === said);
  return key ? text(key) : said;
}
