"""What the voices are made to say: commands, everyday talk, and words that do not exist.

`TRAIN` and `TEST` have no sentence frame and few words in common, so that other talk in a test is new to the model.
"""

# ruff: noqa: E501 (kana count as two columns; lists of words)
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

_DEGREES = ("", "", "", "もっと", "少し", "ちょっと", "もう少し", "うんと")
_WHICH = ("", "", "", "この", "その", "あの", "全部の")
_SIZES = ("", "", "", "大きい", "大きな", "小さい", "小さな")
_COLOURS = ("", "", "", "赤い", "青い", "黄色い", "緑の", "白い", "黒い", "オレンジの", "紫の", "茶色い", "灰色の", "桃色の")
_THINGS = (
    "箱", "玉", "ボール", "円柱", "円錐", "板", "輪っか", "棒", "塊", "バトン", "椅子", "机", "本棚", "花瓶", "時計", "三角", "星",
)  # fmt: skip
_POINTED = ("これ", "それ", "あれ", "全部")
_WHERE = (
    "", "", "右に", "左に", "上に", "下に", "前に", "後ろに", "縦に", "横に", "長さに", "ここに", "そこに", "あそこに", "手前に", "右へ",
    "左へ", "上へ", "下へ", "前へ", "後ろへ", "奥に", "斜めに",
)  # fmt: skip
_VERBS = (
    "動かして", "回して", "伸ばして", "縮めて", "曲げて", "捻って", "置いて", "大きくして", "小さくして", "長くして", "短くして",
    "高くして", "低くして", "広くして", "狭くして", "太くして", "細くして", "硬くして", "柔らかくして", "二倍にして", "半分にして",
    "選んで", "掴んで", "放して", "持ってきて", "持ち上げて", "裏返して", "倒して", "真っ直ぐにして", "尖らせて", "丸くして", "へこませて",
    "膨らませて", "押して", "引っ張って", "赤くして", "青くして", "黄色くして", "緑にして", "白くして", "黒くして", "オレンジにして",
    "紫にして", "コピーして", "消して", "作って", "くっつけて", "分けて", "揃えて", "隠して", "見せて", "離れて", "数えて",
)  # fmt: skip
_ALONE = (
    "元に戻して", "やり直して", "止めて", "続けて", "最初から", "はい", "いいえ", "ください", "止まって", "待って", "保存して", "開いて",
    "閉じて", "選択解除", "もう一度", "おしまい", "始めて", "取り消して",
)  # fmt: skip


@dataclass(frozen=True)
class Talk:
    """Everyday sentences: every choice of one word of each column of one frame is a sentence."""

    frames: tuple[tuple[tuple[str, ...], ...], ...]

    def sentence(self, random: np.random.Generator) -> str:
        frame = self.frames[random.integers(len(self.frames))]
        return "".join(column[random.integers(len(column))] for column in frame)


TRAIN = Talk(
    (
        (
            ("昨日は", "今朝", "来週の火曜日に", "さっき", "明後日", "先月", "夏休みに", "毎晩", "土曜の夜に", "たまに"),
            ("弟が", "母と", "先生は", "隣の人が", "田中さんが", "社長は", "友達と", "私は", "従兄弟が", "お客さんが"),
            ("駅前で", "大学の図書館で", "台所で", "京都の", "空港で", "屋上で", "病院の前で", "海辺で", "喫茶店で"),
            ("珈琲を", "新聞を", "自転車を", "古い写真を", "牛乳を", "着物を", "切符を", "野菜を", "財布を", "百円を", "絵本を"),
            ("飲みました", "読んでいた", "買ったらしい", "落としたそうです", "探しています", "洗っていたよ", "貰いました", "売っていた"),
        ),
        (
            ("この部屋は", "あの映画は", "今年の冬は", "彼の話は", "そのゲームは", "昼ご飯は", "電車は", "新しい靴は"),
            ("とても", "ちょっと", "全然", "思ったより", "本当に", "割と", "やっぱり", "普通に"),
            ("暑いですね", "面白かった", "寒くない", "長かったなあ", "高いと思う", "遅れている", "美味しくなかった", "丈夫です", "静かだ"),
        ),
        (
            ("すみません", "えっと", "あのう", "ねえ", "そうだなあ", "ところで", "じゃあ", "だけど"),
            ("今何時ですか", "窓を開けてもいいですか", "どこへ行くの", "誰が決めたんですか", "明日は雨が降るかもしれない", "電話が鳴っている",
             "写真を送ってくれる", "会議は三時からです", "資料をもう一度確認します", "それは知らなかった", "鍵が見つからない", "一緒に帰ろう",
             "予定を変更しましょう", "聞こえますか", "音が小さいみたい", "画面が映りません", "パスワードを忘れました"),
        ),
        (
            ("東京", "北海道", "鹿児島", "新潟", "四国", "名古屋", "ヨーロッパ", "アメリカ", "病院", "牧場", "美術館", "郵便局"),
            ("から", "まで", "では", "の近くで", "への旅行は", "よりも"),
            ("飛行機で二時間かかります", "祭りがあるそうだ", "雪が降りました", "魚が美味しい", "友人が住んでいます", "中止になりました",
             "バスが便利だよ", "百キロ以上離れている", "地図を見ながら歩いた", "牛や羊がたくさんいる"),
        ),
        (
            ("猫", "漁師", "若者", "医者", "妹", "警察官", "美容師", "兄", "教授", "選手", "客", "留学生"),
            ("が急に", "は必ず", "も時々", "だけが", "は今頃", "がやっと"),
            ("走り出した", "泣き始めた", "勉強しているはずだ", "歌を歌います", "眠ってしまった", "表彰された", "料理を作る", "旅に出た",
             "牛丼を注文した", "百科事典を調べた", "怒鳴っていた", "留守番をしている", "急用を思い出した"),
        ),
    )
)  # fmt: skip

TEST = Talk(
    (
        (
            ("それで", "なんか", "たぶん", "もちろん", "実は", "例えば", "でもさ"),
            ("仕事が忙しくて", "週末は", "駐車場が", "うちの犬は", "授業のあとで", "大阪では", "昔から", "おばあちゃんは"),
            ("なかなか休めない", "山に登るつもりです", "満車だったんです", "散歩が好きなんだ", "アルバイトをしている", "有名ですよね",
             "漬物を漬けている", "考え方が違うと思う", "同じことを言っていた"),
        ),
        (
            ("来月の発表", "新しい機械", "昨日のニュース", "駅の工事", "部長の意見", "壁の時計", "送別会"),
            ("について", "のことで", "に関しては", "のために"),
            ("話し合いました", "何か聞いていますか", "まだ決まっていません", "みんなで準備しよう", "質問があります", "少し困っている",
             "値段を比べてみた", "メールを書いた"),
        ),
        (
            ("お茶でもどうですか", "そろそろ時間です", "おはようございます", "お疲れ様でした", "ありがとうございました", "失礼します",
             "それは大変でしたね", "ちょっと考えさせてください", "いや違うと思いますよ", "了解しました", "もしもし聞こえていますか",
             "天気予報では晴れるらしい", "箱根に行ったことがありますか", "机の上に本がある", "椅子に座って話しましょう", "赤い車を見た",
             "右の方に郵便ポストがあります", "それを聞いて安心した", "小さい頃の夢", "もっと早く言ってよ", "回転寿司が食べたい",
             "玉子焼きを作った", "昔々あるところに", "全部で三千円です", "続きはまた今度"),
        ),
    )
)  # fmt: skip

_MORAE = ["ア", "イ", "ウ", "エ", "オ", "カ", "キ", "ク", "ケ", "コ", "サ", "シ", "ス", "セ", "ソ", "タ", "チ", "ツ", "テ", "ト", "ナ", "ニ", "ヌ", "ネ", "ノ", "ハ", "ヒ", "フ", "ヘ", "ホ", "マ", "ミ", "ム", "メ", "モ", "ヤ", "ユ", "ヨ", "ラ", "リ", "ル", "レ", "ロ", "ワ", "ガ", "ギ", "グ", "ゲ", "ゴ", "ザ", "ジ", "ズ", "ゼ", "ゾ", "ダ", "デ", "ド", "バ", "ビ", "ブ", "ベ", "ボ", "パ", "ピ", "プ", "ペ", "ポ", "キャ", "キュ", "キョ", "シャ", "シュ", "ショ", "チャ", "チュ", "チョ", "ニャ", "ニュ", "ニョ", "ヒャ", "ヒュ", "ヒョ", "ミャ", "ミュ", "ミョ", "リャ", "リュ", "リョ", "ギャ", "ギュ", "ギョ", "ジャ", "ジュ", "ジョ", "ビャ", "ビュ", "ビョ", "ピャ", "ピュ", "ピョ", "ファ", "フィ", "フェ", "フォ", "ティ", "ディ", "シェ", "チェ"]


def command(random: np.random.Generator) -> str:
    """Something one might say to the things of a room; the words of the room's grammar and others beside them."""

    def one(some: tuple[str, ...]) -> str:
        return some[random.integers(len(some))]

    def thing() -> str:
        return one(_POINTED) if random.random() < 0.3 else one(_WHICH) + one(_SIZES) + one(_COLOURS) + one(_THINGS)

    kind = random.random()
    if kind < 0.12:
        return one(_ALONE)
    if kind < 0.25:
        return one(_DEGREES) + one(_WHERE) + one(_VERBS)
    if kind < 0.4:
        return thing() + one(("を", "")) + thing() + "にくっつけて"
    if kind < 0.6:
        return one(_DEGREES) + one(_WHERE) + thing() + one(("を", "を", "")) + one(_VERBS)
    return thing() + one(("を", "を", "")) + one(_DEGREES) + one(_WHERE) + one(_VERBS)


def made_up(random: np.random.Generator) -> str:
    """Words of no language, in katakana: every sound beside every other."""
    words: list[str] = []
    for _ in range(random.integers(1, 4)):
        word = ""
        for place in range(random.integers(2, 6)):
            word += _MORAE[random.integers(len(_MORAE))]
            extra = random.random()
            word += "ン" if extra < 0.08 else "ー" if extra < 0.16 else "ッ" if extra < 0.2 and place < 3 else ""
        words.append(word.rstrip("ッ"))
    return "、".join(words) if random.random() < 0.3 else "".join(words)


def training_texts(random: np.random.Generator) -> Iterator[str]:
    """Endless: more than a third commands, less than a third each of everyday talk and of made-up words."""
    while True:
        kind = random.random()
        yield command(random) if kind < 0.42 else TRAIN.sentence(random) if kind < 0.7 else made_up(random)
