"""C++ source as the architecture tests see it: includes, classes with their members, and where members are defined.

This is no parser. It reads what clang-format has laid out, and takes comments, strings and macros away first.
"""

import re
from dataclasses import dataclass, field


def without_comments(text):
    """`text` with comments and the contents of strings blanked; line numbers stay."""
    def blank(match):
        kept = match[0]
        if kept.startswith("/"):
            return re.sub(r"[^\n]", " ", kept)
        return kept[0] + re.sub(r"[^\n]", " ", kept[1:-1]) + kept[-1] if kept[0] in "\"'" else '""' + "\n" * kept.count("\n")
    return re.sub(r'R"(\w*)\((?:.|\n)*?\)\1"|//[^\n]*|/\*(?:.|\n)*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'',
                  blank, text)


@dataclass
class Include:
    line: int
    target: str
    quoted: bool


def includes(text):
    """The includes of `text`, a file's own text: without_comments would blank the names in quotes."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        if match := re.match(r'\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)', line):
            found.append(Include(number, match[1] or match[2], match[1] is not None))
    return found


@dataclass
class Class:
    name: str
    line: int
    data: list = field(default_factory=list)  # names of non-static data members that are not public
    public_functions: set = field(default_factory=set)  # overloads count once; operators and constructors do not count


def _closing(text, start):
    depth = 0
    for index in range(start, len(text)):
        if text[index] == "{":
            depth += 1
        elif text[index] == "}":
            depth -= 1
            if depth == 0:
                return index
    return len(text)


def _statements(body):
    """The declarations of a class body, each without the inside of its braces."""
    current, index = "", 0
    while index < len(body):
        char = body[index]
        if char == "{":
            end = _closing(body, index)
            current += "{}"
            index = end
            # What follows a function's body is a new declaration; an initialiser's or a class' ends with a semicolon.
            if re.search(r"\)[\w\s:&>()-]*\{\}$", current) and not re.match(r"\s*[;,=]", body[index + 1:]):
                yield current
                current = ""
        elif char == ";":
            yield current
            current = ""
        elif char == ":" and re.fullmatch(r"\s*(public|private|protected)\s*", current):
            yield current.strip() + ":"
            current = ""
        else:
            current += char
        index += 1


def classes(text):
    """Every class and struct that is defined in `text`, nested ones as well."""
    text = re.sub(r"^\s*#.*$", "", without_comments(text), flags=re.M)
    found = []
    for match in re.finditer(r"\b(?<!enum )(class|struct)\s+(?:\[\[\w+\]\]\s*)?(\w+)(?:\s+final)?\s*(?::[^;{]*)?\{", text):
        one = Class(match[2], text.count("\n", 0, match.start()) + 1)
        access = "private" if match[1] == "class" else "public"
        for statement in _statements(text[match.end():_closing(text, match.end() - 1)]):
            if statement in ("public:", "private:", "protected:"):
                access = statement[:-1]
                continue
            words = " ".join(statement.split())
            words = re.sub(r"^template <[^{}()]*?> (?=\w)", "", words)
            if not words or re.match(r"(using|friend|static_assert|enum|class|struct|union|template|typedef)\b", words):
                continue
            outside = re.sub(r"<[^<>()]*(<[^<>]*>)?[^<>()]*>", "", words)  # of template arguments
            function = re.match(r"[^({=]*?(~?\w+|operator\W+)\s*\(", outside)
            if function:
                name = function[1]
                if access == "public" and name.strip("~") != one.name and not name.startswith("operator"):
                    one.public_functions.add(name)
            elif access != "public" and not re.match(r"(static|inline static|constexpr static)\b", words):
                for name in re.findall(r"(\w+_)\s*(?:\[[^\]]*\]|=[^,]*|\{\})?\s*(?:,|$)", outside):
                    one.data.append(name)
        found.append(one)
    return found


def classes_with_members_defined(text):
    """(namespace, class) of each member function that is defined outside of its class."""
    text = without_comments(text)
    namespace = re.search(r"^namespace ([\w:]+) \{", text, re.M)
    names = re.findall(r"^(?:[\w:<>,&*\s\[\]]*?[\s&*])?([A-Z]\w*)(?:<[^>\n]*>)?::(?:~?[\w]+|operator[^\s(]+)\(", text, re.M)
    return {(namespace[1] if namespace else "", name) for name in names}
