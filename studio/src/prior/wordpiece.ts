/** WordPiece as BERT does it: lower case, no accents, split at spaces and punctuation, longest piece first. */

const LONGEST = 100;
/** Characters of a text that are looked at. */
const CHARACTERS = 20_000;
/** Word pieces that the encoder reads, start and end marks among them. */
export const PIECES = 64;

const PUNCTUATION = /[!-/:-@[-`{-~\p{P}]/u;
const CHINESE =
  /[\u4E00-\u9FFF\u3400-\u4DBF\u{20000}-\u{2A6DF}\u{2A700}-\u{2B73F}\u{2B740}-\u{2B81F}\u{2B920}-\u{2CEAF}\uF900-\uFAFF\u{2F800}-\u{2FA1F}]/u;

export class WordPiece {
  private readonly ids: ReadonlyMap<string, number>;

  /** The pieces, one a line. */
  constructor(vocabulary: string) {
    this.ids = new Map(vocabulary.split("\n").map((piece, id) => [piece, id]));
  }

  /** Ids with start and end marks, at most `PIECES`. */
  encode(text: string): number[] {
    const whole = [...text.replace(/[\ud800-\udfff]/gu, "?")].slice(0, CHARACTERS).join("");
    const pieces = words(whole).flatMap((word) => this.split(word));
    return [this.id("[CLS]"), ...pieces.slice(0, PIECES - 2), this.id("[SEP]")];
  }

  private id(piece: string): number {
    return this.ids.get(piece)!;
  }

  private split(word: string): number[] {
    const letters = [...word];
    const found: number[] = [];
    if (letters.length > LONGEST) return [this.id("[UNK]")];
    for (let start = 0; start < letters.length;) {
      let end = letters.length;
      let id: number | undefined;
      for (; end > start && id === undefined; end -= 1)
        id = this.ids.get((start ? "##" : "") + letters.slice(start, end).join(""));
      if (id === undefined) return [this.id("[UNK]")];
      found.push(id);
      start = end + 1;
    }
    return found;
  }
}

function words(text: string): string[] {
  let spaced = "";
  for (const letter of text) {
    if (/[\t\n\r\p{Z}]/u.test(letter)) spaced += " ";
    else if (letter === "\0" || letter === "\ufffd" || /\p{C}/u.test(letter)) continue;
    else spaced += CHINESE.test(letter) ? ` ${letter} ` : letter;
  }
  const plain = Array.from(spaced.normalize("NFD").replace(/\p{Mn}/gu, ""), (letter) => letter.toLowerCase()).join("");
  let parted = "";
  for (const letter of plain) parted += PUNCTUATION.test(letter) ? ` ${letter} ` : letter;
  return parted.split(/\s+/u).filter(Boolean);
}
