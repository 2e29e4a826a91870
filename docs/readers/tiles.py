"""Reads and checks a `.tiles` file, from docs/formats.md alone: python3 tiles.py FILE.tiles [SOURCE.rgba WIDTH HEIGHT]

Checks every checksum and every rule of the document. With a source (4 bytes a texel), level 0 must equal the enlarged
source. Prints one line, or fails at the first broken rule.
"""

import math
import struct
import sys

from xxh3 import xxh3

PAGE = 4096


def check(true, what):
    if not true:
        sys.exit(f"{sys.argv[1]}: {what}")


def pages(length):
    return -(-length // PAGE) * PAGE


class Tiles:
    def __init__(self, data):
        self.data = data
        check(len(data) >= PAGE and data[:8] == bytes.fromhex("894f52540d0a1a0a"), "no .tiles file")
        version, self.m, self.n, self.k, self.b, resident, self.format, zero = struct.unpack_from("<8I", data, 8)
        check(version == 1 and zero == 0, "version")
        stated = struct.unpack_from("<8Q", data, 40)
        check(struct.unpack_from("<Q", data, 4088)[0] == xxh3(data[:4088]), "checksum of the header")
        self.coarsest = max(self.m, self.n)
        self.first_resident = self.coarsest - resident + 1
        self.side = (1 << self.k) + 2 * self.b
        self.tiles = [
            (q, i, j) for q in range(self.first_resident) for i in range(self.grid(q)[1]) for j in range(self.grid(q)[0])
        ]
        texels = self.side**2 + (self.side // 2) ** 2
        tile_bytes = texels * 4 if self.format == 0 else texels // 2
        levels = range(self.first_resident, self.coarsest + 1)
        index_bytes = pages(8 * (len(self.tiles) + len(levels)) + 8)
        records, at = {}, PAGE + index_bytes
        for q in levels:
            width, height = self.size(q)
            records[q] = (at, pages(width * height * 4))
            at += records[q][1]
        tiles_at = at
        for tile in self.tiles:
            records[tile] = (at, pages(tile_bytes))
            at += pages(tile_bytes)
        follows = (len(self.tiles), tile_bytes, pages(tile_bytes), PAGE, index_bytes, PAGE + index_bytes, tiles_at, at)
        check(stated == follows and len(data) == at, f"the header states {stated}, and {follows} follows")
        self.records, self.tile_bytes = records, tile_bytes

    def size(self, q):
        return max(1, 1 << self.m >> q), max(1, 1 << self.n >> q)

    def grid(self, q):
        return tuple(max(1, side >> self.k) for side in self.size(q))

    def check_sums(self):
        index = self.data[PAGE : self.records[self.first_resident][0]]
        check(struct.unpack_from("<Q", index, len(index) - 8)[0] == xxh3(index[:-8]), "checksum of the index")
        order = self.tiles + list(range(self.first_resident, self.coarsest + 1))
        for entry, name in enumerate(order):
            at, length = self.records[name]
            stated = struct.unpack_from("<Q", index, 8 * entry)[0]
            check(stated == xxh3(self.data[at : at + length]), f"checksum of record {name}")
        check(not any(index[8 * len(order) : -8]), "zeros of the index")

    def pictures(self, tile):
        """The tile's own level and the next coarser one, as rows of texels."""
        at, record = self.records[tile]
        check(not any(self.data[at + self.tile_bytes : at + record]), f"zeros behind tile {tile}")
        half = self.side // 2
        return rows(self.data, at, self.side, self.side), rows(self.data, at + 4 * self.side**2, half, half)

    def level(self, q):
        if q >= self.first_resident:
            return rows(self.data, self.records[q][0], *self.size(q))
        width, height = self.size(q)
        whole, s = [[None] * width for _ in range(height)], 1 << self.k
        for _, i, j in (tile for tile in self.tiles if tile[0] == q):
            own = self.pictures((q, i, j))[0]
            for y in range(s):
                whole[i * s + y][j * s : (j + 1) * s] = own[self.b + y][self.b : self.b + s]
        return whole


def rows(data, at, width, height):
    texel = lambda x, y: tuple(data[at + 4 * (y * width + x) :][:4])
    return [[texel(x, y) for x in range(width)] for y in range(height)]


def at_edge(level, x, y):
    """The texel at (x, y). Outside the level, columns wrap, and rows mirror with half a turn."""
    width, height = len(level[0]), len(level)
    if not 0 <= y < height:
        y, x = -1 - y if y < 0 else 2 * height - 1 - y, x + width // 2
    return level[y][x % width]


ONE = 1 << 24


def to_linear(code):
    c = code / 255
    return round(ONE * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4))


LINEAR = [to_linear(code) for code in range(256)]
# Upper limit of each code's interval: the light of code + 1/2.
LIMITS = [
    ONE * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4) for c in ((code + 0.5) / 255 for code in range(255))
]


def to_code(light):
    low, high = 0, 255
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if light >= LIMITS[middle] else (low, middle)
    return low


def mean_of_four(four):
    light = [(sum(LINEAR[texel[c]] for texel in four) + 2) >> 2 for c in range(3)]
    return (*map(to_code, light), (sum(texel[3] for texel in four) + 2) >> 2)


def taps(index, source, target):
    """The first of the four source texels, and their weights in 2^14ths."""
    numerator = (2 * index + 1) * source - target
    first, rest = divmod(numerator, 2 * target)
    t = (rest << 16) // (2 * target)
    t1, t2, t3, one = t << 32, t * t << 16, t**3, 1 << 48
    twice = [-t3 + 2 * t2 - t1, 3 * t3 - 5 * t2 + 2 * one, -3 * t3 + 4 * t2 + t1, t3 - t2]
    weights = [(w + (1 << 34)) >> 35 for w in twice]
    weights[1 if weights[1] >= weights[2] else 2] += (1 << 14) - sum(weights)
    return first - 1, weights


def enlarged(source, size):
    """Catmull-Rom in linear light, along the rows first; columns wrap, rows repeat at the edges."""
    width, height = len(source[0]), len(source)
    weighted = lambda four, weights: tuple(
        (sum(texel[c] * w for texel, w in zip(four, weights)) + (1 << 13)) >> 14 for c in range(4)
    )
    light = [[(*(LINEAR[c] for c in texel[:3]), (texel[3] * ONE + 127) // 255) for texel in row] for row in source]
    columns, lines = [taps(x, width, size[0]) for x in range(size[0])], [taps(y, height, size[1]) for y in range(size[1])]
    wide = [[weighted([row[(first + n) % width] for n in range(4)], w) for first, w in columns] for row in light]
    result = []
    for first, w in lines:
        four = [wide[min(max(first + n, 0), height - 1)] for n in range(4)]
        texels = [weighted([row[x] for row in four], w) for x in range(size[0])]
        alpha = lambda a: (min(max(a, 0), ONE) * 255 + ONE // 2) >> 24
        result.append([(*map(to_code, texel[:3]), alpha(texel[3])) for texel in texels])
    return result


def main():
    file = Tiles(open(sys.argv[1], "rb").read())
    file.check_sums()
    if file.format == 0:
        levels = [file.level(q) for q in range(file.coarsest + 1)]
        s = 1 << file.k
        for q, i, j in file.tiles:
            own, coarser = file.pictures((q, i, j))
            left, top = j * s - file.b, i * s - file.b
            expected = [[at_edge(levels[q], left + x, top + y) for x in range(file.side)] for y in range(file.side)]
            check(own == expected, f"border of tile {q, i, j}")
            half = range(file.side // 2)
            expected = [[at_edge(levels[q + 1], (left >> 1) + x, (top >> 1) + y) for x in half] for y in half]
            check(coarser == expected, f"second picture of tile {q, i, j}")
        for q, finer in enumerate(levels[:-1]):
            width, height = file.size(q + 1)
            four = lambda x, y: [finer[min(v, len(finer) - 1)][min(u, len(finer[0]) - 1)]
                                 for v in (2 * y, 2 * y + 1) for u in (2 * x, 2 * x + 1)]
            expected = [[mean_of_four(four(x, y)) for x in range(width)] for y in range(height)]
            check(levels[q + 1] == expected, f"level {q + 1} is no mean of level {q}")
        if len(sys.argv) > 2:
            width, height = int(sys.argv[3]), int(sys.argv[4])
            source = rows(open(sys.argv[2], "rb").read(), 0, width, height)
            check(levels[0] == (source if (width, height) == file.size(0) else enlarged(source, file.size(0))), "level 0")
    print(f"{len(file.tiles)} tiles, {len(file.data)} bytes, all as documented")


main()
