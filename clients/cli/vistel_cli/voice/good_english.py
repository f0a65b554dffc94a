"""Whether an English sentence of a grammar is good English.

A grammar also has sentences that are not ("all the box", "a orange ring"): people say such things, and they are
understood. Examples, which people read, should be sentences that people would write.
"""

from vistel.speech.grammar import Sentence

_VOWELS = tuple("aeiou")


def is_good_english(sentence: Sentence) -> bool:
    """Whether the articles, plurals and words of degree of an English sentence go together."""
    every = False
    followers = [*(w.written for w in sentence.words[1:]), ""]
    for word, follower in zip(sentence.words, followers, strict=True):
        tags = {name.rpartition(".")[2] for name, _ in word.means}
        if "every" in tags:
            every = True
        elif "shown" in tags or word.written in ("the", "a", "an"):
            every = False
        if word.written in ("a", "an") and follower.startswith(_VOWELS) != (word.written == "an"):
            return False
        if ("shape" in tags or word.written == "one") and word.written.endswith("s") != every:
            return False
        if "degree" in tags and not _goes_before(word.written, follower):
            return False
    return True


def _goes_before(degree: str, follower: str) -> bool:
    """Whether a word of degree may stand before a word; "": at the end."""
    if degree == "much":
        return follower.endswith("er")
    return degree != "a lot" or not follower or follower.endswith("er")
