"""The screen that Xvfb keeps in a file (XWD, 32 bits per pixel) as PNG."""
import struct
import sys
import zlib

with open(sys.argv[1], "rb") as file:
    content = file.read()
head = struct.unpack(">25I", content[:100])
size, width, height, row, colours = head[0], head[4], head[5], head[12], head[19]
pixels = content[size + 12 * colours:]
rows = b""
for y in range(height):
    line = pixels[y * row:y * row + 4 * width]
    rgb = bytearray(3 * width)
    rgb[0::3], rgb[1::3], rgb[2::3] = line[2::4], line[1::4], line[0::4]
    rows += b"\0" + bytes(rgb)


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


with open(sys.argv[2], "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)) +
               chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))
