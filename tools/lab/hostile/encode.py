# SPDX-License-Identifier: MIT
"""Makes small valid pictures: PNG, JPEG (baseline and progressive) and lossless WebP, with the standard library alone."""

import struct
import zlib


class Bits:
    def __init__(self, lowest_first):
        self.lowest_first, self.bits = lowest_first, []

    def put(self, value, count):
        order = range(count) if self.lowest_first else reversed(range(count))
        self.bits += [value >> i & 1 for i in order]

    def bytes(self, fill=0):
        bits = self.bits + [fill] * (-len(self.bits) % 8)
        packed = bytearray()
        for i in range(0, len(bits), 8):
            byte = bits[i:i + 8]
            packed.append(sum(b << (k if self.lowest_first else 7 - k) for k, b in enumerate(byte)))
        return bytes(packed)


def png(width, height, pixel, channels=3):
    """pixel(x, y) -> `channels` bytes; 1 gray, 3 RGB, 4 RGBA."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)[:channels]) for x in range(width)) for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def jpeg(width, height, pixel, progressive=False, components=3):
    """Blocks of one value each. pixel(x, y) -> Y, Cb, Cr of a block's first pixel."""
    def segment(marker, body):
        return bytes([0xff, marker]) + struct.pack(">H", len(body) + 2) + body

    ids = range(1, components + 1)
    frame = struct.pack(">BHHB", 8, height, width, components) + b"".join(bytes([i, 0x11, 0]) for i in ids)
    # lengths for the categories 0 to 11, as in the standard's example
    dc_lengths = [2, 3, 3, 3, 3, 3, 4, 5, 6, 7, 8, 9]
    codes, code, last = [], 0, dc_lengths[0]
    for length in dc_lengths:
        code <<= length - last
        codes.append((code, length))
        code, last = code + 1, length
    counts = bytes(dc_lengths.count(n) for n in range(1, 17))
    out = b"\xff\xd8" + segment(0xe0, b"JFIF\0\1\1\0\0\1\0\1\0\0") + segment(0xdb, b"\0" + bytes([8] * 64))
    out += segment(0xc2 if progressive else 0xc0, frame)
    out += segment(0xc4, b"\0" + counts + bytes(range(12))) + segment(0xc4, b"\x10" + bytes([1] + [0] * 15) + b"\0")
    blocks = [(8 * x, 8 * y) for y in range(-(-height // 8)) for x in range(-(-width // 8))]

    def scan(chosen, first, last, with_dc, with_ac):
        bits, before = Bits(False), [0] * components
        for x, y in blocks:
            for c in chosen:
                if with_dc:
                    value = pixel(x, y)[c] - 128
                    change, before[c] = value - before[c], value
                    category = abs(change).bit_length()
                    bits.put(*codes[category])
                    bits.put(change if change >= 0 else change + (1 << category) - 1, category)
                if with_ac:
                    bits.put(0, 1)  # end of block
        head = bytes([len(chosen)]) + b"".join(bytes([c + 1, 0]) for c in chosen) + bytes([first, last, 0])
        return segment(0xda, head) + bits.bytes(1).replace(b"\xff", b"\xff\0")

    everyone = list(range(components))
    if not progressive:
        out += scan(everyone, 0, 63, True, True)
    else:
        out += scan(everyone, 0, 0, True, False)
        for c in everyone:
            out += scan([c], 1, 63, False, True)
    return out + b"\xff\xd9"


def webp(width, height, pixel):
    """Lossless, every literal in eight bits. pixel(x, y) -> R, G, B."""
    bits = Bits(True)
    bits.put(0x2f, 8)
    bits.put(width - 1, 14)
    bits.put(height - 1, 14)
    bits.put(0, 4 + 3)  # no alpha, version 0; no transform, no colour cache, one group of codes
    for spare in (24, 0, 0):  # green with lengths of copies, red, blue
        bits.put(0, 1)
        bits.put(12 - 4, 4)
        for symbol in (17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8):
            bits.put(1 if symbol in (8, 18) else 0, 3)
        bits.put(0, 1)
        bits.put(0, 256)  # each literal has length 8
        if spare:
            bits.put(1, 1)
            bits.put(spare - 11, 7)
    for symbol in (255, 0):  # alpha; distances
        bits.put(0b101, 3)
        bits.put(symbol, 8)
    for y in range(height):
        for x in range(width):
            red, green, blue = pixel(x, y)[:3]
            for value in (green, red, blue):
                bits.put(int(f"{value:08b}"[::-1], 2), 8)
    body = bits.bytes()
    body += b"\0" * (len(body) % 2)
    return b"RIFF" + struct.pack("<I", len(body) + 12) + b"WEBPVP8L" + struct.pack("<I", len(body)) + body
