"""Checks an MCAP record with the Python package `mcap`, which shares no code with ours.

read-mcap.py FILE [STATUSES] checks every checksum, every channel, and every message against its schema. With STATUSES it also
checks the number of statuses, and reads the file truncated.
"""
import collections, io, json, sys
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader

STATUSES = int(sys.argv[2]) if len(sys.argv) > 2 else None
TYPES = {"integer": int, "number": (int, float), "string": str, "boolean": bool, "array": list, "object": dict}

def check(value, schema, path):
    assert isinstance(value, TYPES[schema["type"]]), f"{path} is {value!r}, no {schema['type']}"
    for name in schema.get("required", []):
        check(value[name], schema["properties"][name], f"{path}.{name}")
    assert schema["type"] != "object" or set(value) == set(schema["properties"]), path
    for item in value if schema["type"] == "array" else []:
        check(item, schema["items"], path)

data = open(sys.argv[1], "rb").read()
# Reads the whole file with its attachments, which the reader of messages leaves out.
assert sum(1 for _ in StreamReader(io.BytesIO(data), validate_crcs=True).records) > 0
counts, last = collections.Counter(), {}
for schema, channel, message in make_reader(io.BytesIO(data), validate_crcs=True).iter_messages(log_time_order=False):
    counts[channel.topic] += 1
    if channel.topic == "/records":
        assert schema is None and message.data[-1] == 0 and 0 not in message.data[:-1], "one frame per message"
        continue
    assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
    value = json.loads(message.data)
    check(value, json.loads(schema.data), channel.topic)
    if channel.topic == "/status":
        assert message.log_time > last.get("/status", -1) and message.log_time == round(value["time_s"] * 1e9)
        last["/status"] = message.log_time
statistics = make_reader(io.BytesIO(data)).get_summary().statistics
assert statistics.message_count == sum(counts.values())
assert set(counts) == {"/status", "/terms", "/events", "/log", "/records"}, counts
assert counts["/status"] == counts["/terms"] == (STATUSES or counts["/status"]), counts

def whole(length):
    """The messages that the reader finds in the first bytes."""
    found = 0
    try:
        for record in StreamReader(io.BytesIO(data[:length])).records:
            found += isinstance(record, Message)
    except (McapError, EOFError):
        pass
    return found

for share in (0.1, 0.5, 0.9) if STATUSES else ():
    found = whole(int(len(data) * share))
    # This reader loses the chunk in which the file ends: half a second of 24 s.
    assert found > (share - 0.03) * sum(counts.values()), f"{share} of the file: {found} messages"
print(f"record: {len(data)} bytes, {dict(counts)}, as the Python reader finds them")
