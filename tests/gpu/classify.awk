# SPDX-License-Identifier: Apache-2.0
# awk -f classify.awk MOVED EXPECTED FOUND: compares two lists of fragments (made by fragments() in common.sh), and
# counts equal fragments and, by class, different ones. Rasterisers round vertices to a grid of 1/256 of a pixel, and
# interpolate depths before or after rounding. MOVED (made by moved.awk) has the range of each fragment's depth in
# pictures that are moved by a step of that grid. Texture filters differ by more. Prints the counts on a line, then up
# to five fragments that exceed all limits. Fails if more than one fragment in 50 exceeds them. (A few may do so at
# masks, where a filtered alpha is above or below the cutoff.)
BEGIN {
    color_limit = 1 / 20 # as a fraction of white
    beyond_share = 1 / 50
    rounding = 2 # in units in the last place of a float
}
function distance(a, b) { return a > b ? a - b : b - a }
function half(bits, exponent) {
    exponent = int(bits / 1024) % 32
    return exponent ? (1024 + bits % 1024) * 2 ^ (exponent - 25) : bits % 1024 * 2 ^ -24
}
function is(class, text) {
    ++count[class]
    if (class == "beyond" && count[class] <= 5) examples = examples "\n" text
}
FILENAME == ARGV[1] {
    key = $1 " " $2 " " $3 " " $4
    edge[key] = $5 < 9
    margin = ($7 - $6) / 2 + rounding
    nearest[key] = $6 - margin
    farthest[key] = $7 + margin
    next
}
{ key = $1 " " $7 " " $8 " " $9 }
FILENAME == ARGV[2] { expected[key] = $0; next }
{ ++all }
!(key in expected) { is(key in edge ? "edge" : "beyond", "only found: " $0); next }
{
    split(expected[key], was)
    delete expected[key]
    color = 0
    for (i = 3; i <= 6; ++i)
        if (distance(half($i), half(was[i])) > color) color = distance(half($i), half(was[i]))
    if (color > largest) largest = color
    if ($2 < nearest[key] || $2 > farthest[key] || color > color_limit)
        is(edge[key] ? "edge" : "beyond", "expected " $1 " " was[2] " " was[3] " " was[4] " " was[5] " " was[6] ", found " $0)
    else
        is(distance($2, was[2]) > rounding ? "depth" : color > 0 ? "color" : "same")
}
END {
    for (key in expected) is(edge[key] ? "edge" : "beyond", "only expected: " expected[key])
    printf "%d the same, %d other depth, %d other colour, %d at edges, %d beyond, colours differ by %.4f at most%s\n",
        count["same"], count["depth"], count["color"], count["edge"], count["beyond"], largest, examples
    exit count["beyond"] > all * beyond_share
}
