"""Write the assertions of the stand-in `funit` that differ only in type and rank."""

import sys

KINDS = {
    "integer": ("integer", "integer(int32)"),
    "long": ("integer", "integer(int64)"),
    "real": ("real", "real(real64)"),
}
SHAPES = {0: "", 1: "(:)", 2: "(:, :)"}
PAIRS = [(0, 0), (0, 1), (0, 2), (1, 1), (2, 2)]


def header(name, kind, ranks, extra=""):
    """The opening of an assertion on an expected and an actual value."""
    declared = KINDS[kind][1]
    return f"""
   subroutine {name}(expected, actual{extra}, message, location)
      {declared}, intent(in) :: expected{SHAPES[ranks[0]]}
      {declared}, intent(in) :: actual{SHAPES[ranks[1]]}
"""


TAIL = """      character(*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
"""


def same_shape(ranks):
    """Test that two arrays are of one shape."""
    if ranks[0] == 0:
        return ""
    return """      if (any(shape(expected) /= shape(actual))) then
         call raise('the arrays are of different shapes', message, location)
         return
      end if
"""


def equal(kind, ranks):
    """assertEqual; reals take a tolerance."""
    name = f"equal_{kind}_{ranks[0]}{ranks[1]}"
    real = kind == "real"
    text = header(name, kind, ranks, ", tolerance" if real else "")
    if real:
        text += "      real(real64), intent(in), optional :: tolerance\n"
    text += TAIL
    if real:
        text += "      real(real64) :: allowed\n"
    text += "\n" + same_shape(ranks)
    if real:
        text += """      allowed = 0.0_real64
      if (present(tolerance)) allowed = tolerance
"""
        wrong = ".not. close(expected, actual, allowed)"
    else:
        wrong = "expected /= actual"
    if ranks == (0, 0):
        text += f"""      if ({wrong}) &
         call raise('expected '//words(expected)//' but found '//words(actual), message, location)
"""
    else:
        test = f"any({wrong})"
        text += f"""      if ({test}) call raise('arrays differ', message, location)
"""
    return name, text + f"   end subroutine {name}\n"


def ordered(kind, name, operator, words):
    """assertLessThan and its like, on scalars."""
    name = f"{name}_{kind}"
    text = header(name, kind, (0, 0)) + TAIL
    text += f"""
      if (.not. expected {operator} actual) &
         call raise('expected '//words(expected)//' to be {words} '//words(actual), message, location)
   end subroutine {name}
"""
    return name, text


ORDERS = {
    "assertLessThan": ("<", "less than"),
    "assertLessThanOrEqual": ("<=", "at most"),
    "assertGreaterThan": (">", "greater than"),
    "assertGreaterThanOrEqual": (">=", "at least"),
}


def relatively(ranks):
    """assertRelativelyEqual."""
    name = f"relatively_{ranks[0]}{ranks[1]}"
    text = header(name, "real", ranks, ", tolerance")
    text += "      real(real64), intent(in) :: tolerance\n" + TAIL + "\n" + same_shape(ranks)
    wrong = ".not. abs(expected - actual) <= tolerance*abs(expected)"
    if ranks == (0, 0):
        text += f"""      if ({wrong}) &
         call raise('expected '//words(expected)//' but found '//words(actual), message, location)
"""
    else:
        text += f"      if (any({wrong})) call raise('arrays differ', message, location)\n"
    return name, text + f"   end subroutine {name}\n"


def main(template, output):
    """Fill the template."""
    interfaces, bodies = [], []

    def take(generic, made):
        names = ", ".join(name for name, _ in made)
        interfaces.append(f"   interface {generic}\n      procedure :: {names}\n   end interface {generic}\n")
        bodies.extend(text for _, text in made)

    made = [equal(kind, ranks) for kind in KINDS for ranks in PAIRS]
    made += [("equal_text", ""), ("equal_logical_00", ""), ("equal_logical_11", "")]
    interfaces_names = ", &\n                   ".join(name for name, _ in made)
    interfaces.append(f"   interface assertEqual\n      procedure :: {interfaces_names}\n   end interface assertEqual\n")
    bodies.extend(text for _, text in made)
    for generic, (operator, words) in ORDERS.items():
        take(generic, [ordered(kind, generic, operator, words) for kind in KINDS])
    take("assertRelativelyEqual", [relatively(ranks) for ranks in PAIRS])
    with open(template, encoding="utf-8") as stream:
        text = stream.read()
    text = text.replace("   !INTERFACES\n", "\n".join(interfaces)).replace("   !BODIES\n", "".join(bodies).lstrip("\n"))
    with open(output, "w", encoding="utf-8") as stream:
        stream.write(text)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
