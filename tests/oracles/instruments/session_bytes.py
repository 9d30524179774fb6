"""Encodes orders and decodes answers with thorlabs-apt-protocol; talks JSON over its own standard streams.

Takes ``{"orders": [[function, arguments], …], "answers": hex}``; prints the orders' bytes in hexadecimal and
the fields of the answers.
"""

import json
import sys

import thorlabs_apt_protocol as apt

task = json.load(sys.stdin)
orders = [getattr(apt, name)(dest=0x50, source=1, **fields).hex() for name, fields in task["orders"]]
unpacker = apt.Unpacker()
answers = []
for byte in bytes.fromhex(task["answers"]):
    unpacker.feed(bytes([byte]))
    answers += [answer._asdict() for answer in unpacker]
json.dump({"orders": orders, "answers": answers}, sys.stdout, default=bytes.decode)
