# SPDX-License-Identifier: Apache-2.0
# awk -f classify.awk EDGES EXPECTED FOUND: what is the same in two lists of fragments (fragments() in
# common.sh) and what differs, by class. EDGES has the fragments that are there or not if the picture is
# moved by 1/256 of a pixel. Prints a line, then up to five of what is beyond all limits; fails if
# anything is. Which fragment is the nearer of two in a pixel need not be told apart from Z: both
# lists are sorted by it.
BEGIN {
    limit["depth"] = 2 # units in the last place of a float
    limit["color"] = 1 # of a half
}
function distance(a, b) { return a > b ? a - b : b - a }
function is(class, text) {
    ++count[class]
    if (class == "beyond" && count[class] <= 5) examples = examples "\n" text
}
FILENAME == ARGV[1] { edge[$0]; next }
{ key = $1 " " $7 " " $8 " " $9 }
FILENAME == ARGV[2] { expected[key] = $0; next }
!(key in expected) { is(key in edge ? "coverage" : "beyond", "only found: " $0); next }
{
    split(expected[key], was)
    depth = distance($2, was[2])
    color = 0
    for (i = 3; i <= 6; ++i)
        if (distance($i, was[i]) > color) color = distance($i, was[i])
    if (depth > limit["depth"] || color > limit["color"])
        is("beyond", "expected " expected[key] ", found " $0)
    else
        is(depth > 0 ? "depth" : color > 0 ? "color" : "same")
    delete expected[key]
}
END {
    for (key in expected) is(key in edge ? "coverage" : "beyond", "only expected: " expected[key])
    printf "%d the same, %d other depth, %d other colour, %d other coverage, %d beyond%s\n", count["same"],
        count["depth"], count["color"], count["coverage"], count["beyond"], examples
    exit count["beyond"] > 0
}
