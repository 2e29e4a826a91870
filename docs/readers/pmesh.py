"""Reads a `.pmesh` file, from docs/pmesh.md alone: python3 pmesh.py FILE.pmesh

Prints the metric of the errors, then a line for each chunk, after its last level: level, vertices, faces, the
checksum (xxh3) of the buffer of faces (three u32 each, in the order of the slots), and the error. With births in
place, a line with `drawn` for the buffer that the level draws, once the last level of its group is read. Then the
checksum of all vertices: position (three f32), and normal, coordinate and color if the file has them. Fails at the
first broken rule.
"""

import struct
import sys
from collections import defaultdict

from xxh3 import xxh3


def check(true, what):
    if not true:
        sys.exit(f"{sys.argv[1]}: {what}")


class Coder:
    """The decoder of one chunk; the models persist across chunks."""

    def __init__(self, data, models):
        self.data, self.models, self.at, self.range, self.code = data, models, 0, 0xFFFFFFFF, 0
        for _ in range(4):
            self.byte()

    def byte(self):
        check(self.at < len(self.data), "a chunk ends early")
        self.code = (self.code << 8 | self.data[self.at]) & 0xFFFFFFFF
        self.at += 1

    def shrink(self):
        while self.range < 1 << 24:
            self.range = self.range << 8 & 0xFFFFFFFF
            self.byte()

    def bit(self, *name):
        model = self.models[name]
        one, seen = model
        bound = (self.range >> 12) * min(max(one >> 4, 32), 4064)
        step = 131072 // (2 * seen + 3)
        bit = int(self.code < bound)
        if bit:
            self.range = bound
            model[0] += (65535 - one) * step >> 16
        else:
            self.code -= bound
            self.range -= bound
            model[0] -= one * step >> 16
        model[1] = min(seen + 1, 60)
        self.shrink()
        return bit

    def raw(self):
        self.range >>= 1
        bit = int(self.code >= self.range)
        self.code -= self.range * bit
        self.shrink()
        return bit

    def tree(self, bits, *name):
        node = 1
        for _ in range(bits):
            node = 2 * node + self.bit(*name, node)
        return node - (1 << bits)

    def number(self, *name):
        count = self.tree(6, *name)
        check(count <= 32, "a number of more than 32 bits")
        if count < 2:
            return count
        top = min(3, count - 1)
        value = 1 << top | self.tree(top, *name, "below", count)
        for _ in range(count - 1 - top):
            value = value << 1 | self.raw()
        return value

    def signed(self, *name):
        number = self.number(*name)
        return -(number + 1) // 2 if number % 2 else number // 2


def key(bits):
    """A float's bits as an integer that sorts as the float does."""
    return 0xFFFFFFFF - bits if bits >> 31 else bits + (1 << 31)


def bits_of(key):
    return key - (1 << 31) if key >> 31 else 0xFFFFFFFF - key


PARTS = [("normal", 3, 1), ("coordinate", 2, 2), ("color", 4, 4)]


class Mesh:
    def __init__(self, attributes):
        self.parts = [("position", 3)] + [(name, count) for name, count, bit in PARTS if attributes & bit]
        # By vertex: its keys (floats) or bytes (color) by part, and the first vertex of its position.
        self.vertices, self.first = [], []
        # By face: its corners and its slot. By slot: its face. By vertex: its faces, ascending.
        self.faces, self.slot_of, self.buffer = [], [], []
        self.around = []
        self.error = 0x7F7FFFFF
        # By vertex: its predecessor, drawn before it is live. Live vertices by level.
        self.predecessors, self.live = [], []

    def ring(self, s):
        """The faces around s as (face, a, b), in order."""
        turned = {}
        for face in sorted(self.around[s]):
            corners = self.faces[face]
            n = corners.index(s)
            turned[face] = (corners[(n + 1) % 3], corners[(n + 2) % 3])
        ends = {b for _, b in turned.values()}
        order, seen = [], set()
        starts = [f for f in turned if turned[f][0] not in ends] + list(turned)
        for face in starts:
            while face is not None and face not in seen:
                seen.add(face)
                order.append((face, *turned[face]))
                face = next((f for f in turned if turned[f][0] == turned[face][1]), None)
        return order

    def split(self, coder, t, before):
        """Reads the vertex that t splits and the faces that t takes. Returns the split vertex (or None) and its ring."""
        if coder.bit("nowhere"):
            return None, []
        if coder.bit("near"):
            listed = []
            for face in sorted(self.around[t - 1]):
                if len(listed) >= 32:
                    break
                listed += [c for c in self.faces[face] if c < before and c not in listed]
            place = coder.number("neighbour")
            check(place < len(listed), f"vertex {t}: no such neighbour")
            s = listed[place]
        else:
            s = before - 1 - coder.number("age")
            check(s >= 0, f"vertex {t}: no such split vertex")
        ring, taken, turns, last = self.ring(s), [], 0, None
        for n, (face, a, b) in enumerate(ring):
            takes = coder.bit("takes", min(turns, 3), min(n, 7), last)
            turns += last is not None and takes != last
            last = takes
            taken.append(takes)
        for (face, a, b), takes in zip(ring, taken):
            if takes:
                self.faces[face] = [t if corner == s else corner for corner in self.faces[face]]
                self.around[s].remove(face)
                self.around[t].add(face)
        return s, [(a, b, takes) for (face, a, b), takes in zip(ring, taken)]

    def vertex(self, coder, t, s):
        welded = coder.number("welded")
        check(welded <= t, f"vertex {t}: welded to none")
        base = self.vertices[s] if s is not None else self.vertices[t - 1] if t else None
        own = {}
        for name, count in self.parts:
            if name == "position" and welded:
                own[name] = self.vertices[t - welded][name]
                continue
            zero = 0 if name == "color" else key(0)
            modulo = (1 << 8) - 1 if name == "color" else (1 << 32) - 1
            old = base[name] if base else [zero] * count
            own[name] = [old[n] + coder.signed(name, n) & modulo for n in range(count)]
        self.vertices.append(own)

    def suggestions(self, splits):
        found = []
        for s, t, ring in splits:
            if len(found) >= 65536:
                continue
            starts = [{a for a, _, takes in ring if takes == which} for which in (0, 1)]
            ends = [{b for _, b, takes in ring if takes == which} for which in (0, 1)]
            for a, b, takes in ring:
                if takes:
                    if a not in ends[1]:
                        found.append((0 if a in ends[0] else 1, (s, a, t)))
                    if b not in starts[1]:
                        found.append((0 if b in starts[0] else 1, (t, b, s)))
                else:
                    if a not in ends[0] | ends[1]:
                        found.append((2, (t, a, s)))
                    if b not in starts[0] | starts[1]:
                        found.append((2, (s, b, t)))
        return [corners for _, corners in sorted(found, key=lambda one: one[0])]

    def face(self, coder, suggested, is_first):
        place = coder.number("place", is_first)
        if place < len(suggested):
            by = coder.tree(2, "rotation") % 3
            corners = suggested[place][by:] + suggested[place][:by]
        else:
            check(place == len(suggested), "no such suggestion")
            corners = tuple(len(self.vertices) - 1 - coder.number("corner") for _ in range(3))
        check(len(set(corners)) == 3 and min(corners) >= 0, f"face {corners}")
        for corner in corners:
            self.around[corner].add(len(self.faces))
        self.slot_of.append(len(self.buffer))
        self.buffer.append(len(self.faces))
        self.faces.append(list(corners))

    def permutation(self, coder):
        """Reads a permutation; returns whether there is one."""
        if not coder.bit("is there"):
            return False
        slots, at = [], -1
        for _ in range(coder.number("moved")):
            at += 1 + coder.number("gap")
            check(at < len(self.buffer), "a permutation beyond the buffer")
            slots.append(at)
        old, waiting = list(self.buffer), {self.buffer[slot] for slot in slots}
        former, after_first = {face: slot for slot, face in enumerate(old)}, True
        for slot in slots:
            listed = self.candidates(slot, old, former, waiting)
            rank = next((rank for rank in range(24) if coder.bit("rank", after_first, rank)), None)
            check(rank is None or rank < len(listed), "no such suggestion")
            found = None if rank is None else listed[rank]
            after_first = rank == 0
            if found is None:
                lowest = next(n for n, other in enumerate(slots) if old[other] in waiting)
                at = lowest + coder.number("other")
                check(at < len(slots) and old[slots[at]] in waiting, "a face that does not move, or twice")
                found = old[slots[at]]
            waiting.remove(found)
            self.buffer[slot] = found
            self.slot_of[found] = slot
        return True

    def candidates(self, slot, old, former, waiting):
        listed = []
        def add(face):
            if face in waiting and face not in listed and len(listed) < 24:
                listed.append(face)
        if slot and former[self.buffer[slot - 1]] + 1 < len(old):
            add(old[former[self.buffer[slot - 1]] + 1])
        for n in range(slot - 1, max(slot - 9, -1), -1):
            for corner in self.faces[self.buffer[n]]:
                for face in sorted(self.around[corner]):
                    add(face)
        return listed

    def level(self, coder, is_first):
        before, splits = len(self.vertices), []
        vertices, faces = coder.number("vertices"), coder.number("faces")
        self.error -= coder.number("error")
        for t in range(before, before + vertices):
            self.around.append(set())
            s, ring = (None, []) if is_first else self.split(coder, t, before)
            if s is not None:
                splits.append((s, t, ring))
            self.vertex(coder, t, s)
        of = {t: s for s, t, _ in splits}
        other = next((of[t] for t in range(before, before + vertices) if t in of), 0)
        self.predecessors += [of.get(t, other) for t in range(before, before + vertices)]
        self.live.append(len(self.vertices))
        suggested = self.suggestions(splits)
        for n in range(faces):
            self.face(coder, suggested, n == 0)
        return not is_first and self.permutation(coder)

    def shown(self, vertex, live):
        while vertex >= max(live, 1):
            vertex = self.predecessors[vertex]
        return vertex

    def drawn(self, level):
        """The buffer of a level whose group ends here."""
        live = self.live[level]
        corners = [self.shown(corner, live) for face in self.buffer for corner in self.faces[face]]
        return f"drawn {level} {len(self.buffer)} {xxh3(struct.pack(f'<{len(corners)}I', *corners)):016x}"

    def summary(self):
        corners = [corner for face in self.buffer for corner in self.faces[face]]
        error = struct.unpack("<f", struct.pack("<I", self.error))[0]
        return f"{len(self.vertices)} {len(self.faces)} {xxh3(struct.pack(f'<{len(corners)}I', *corners)):016x} {error:g}"

    def vertex_bytes(self):
        data = bytearray()
        for vertex in self.vertices:
            for name, values in vertex.items():
                data += bytes(values) if name == "color" else struct.pack(f"<{len(values)}I", *map(bits_of, values))
        return bytes(data)


def main():
    data = open(sys.argv[1], "rb").read()
    check(len(data) >= 72 and data[:8] == bytes.fromhex("894f504d0d0a1a0a"), "no .pmesh file")
    check(xxh3(data[:64]) == struct.unpack_from("<Q", data, 64)[0], "checksum of the header")
    version, flags = struct.unpack_from("<2I", data, 8)
    vertices, faces, levels, chunks = struct.unpack_from("<4I", data, 40)
    check(version in (1, 2, 3) and flags < (32 if version == 3 else 8), "version")
    in_place = flags >> 3 & 1 if version == 3 else version == 2
    print("metric", ("geometry", "appearance")[flags >> 4] if version == 3 else "unknown")
    check(struct.unpack_from("<Q", data, 56)[0] == len(data), "length")
    mesh, models, at, done, waiting = Mesh(flags & 7), defaultdict(lambda: [32768, 0]), 72, 0, []
    for number in range(chunks):
        size, count, *_ = struct.unpack_from("<5I", data, at)
        payload = data[at + 28 : at + 28 + size]
        seed = xxh3(data[at : at + 20], number)
        check(xxh3(payload, seed) == struct.unpack_from("<Q", data, at + 20)[0], f"checksum of chunk {number}")
        coder = Coder(payload, models)
        for _ in range(count):
            if mesh.level(coder, done == 0) or done + 1 == levels:
                for level in waiting:
                    print(mesh.drawn(level))
                waiting = []
            done += 1
        check(not any(payload[coder.at :]), f"zeros behind chunk {number}")
        print(done - 1, mesh.summary())
        if in_place and done < levels:
            waiting.append(done - 1)
        at += 28 + size
    check(at == len(data) and done == levels, "levels")
    check((len(mesh.vertices), len(mesh.faces)) == (vertices, faces), "vertices and faces")
    print(f"vertices {xxh3(mesh.vertex_bytes()):016x}")


main()
