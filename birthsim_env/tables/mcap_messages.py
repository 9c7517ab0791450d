"""Messages of an MCAP file, one after the other, of which no more is unpacked than a limit allows."""

import io
from collections.abc import Iterator
from typing import Any

import lz4.frame
import zstandard
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader

from birthsim_env.physics.rig.json_reading import parse_json


def json_messages(content: bytes, most: int, longest: int) -> Iterator[tuple[str, int, Any]]:
    """Topic, time in ns and content of all messages, in the file's order; the content is None where it is not JSON.

    ``ValueError`` where they take more than ``most`` bytes unpacked, one in JSON more than ``longest``, or is damaged.
    """
    channels: dict[int, Channel] = {}
    for record in _records(content, most):
        if isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            channel = channels[record.channel_id]
            if channel.message_encoding != "json":
                yield channel.topic, record.log_time, None
                continue
            if len(record.data) > longest:
                raise ValueError(f"a message of {channel.topic} has {len(record.data)} bytes; allowed: up to {longest}")
            yield channel.topic, record.log_time, parse_json(f"a message of {channel.topic}", record.data, dict, finite=False)


def _records(content: bytes, most: int) -> Iterator[object]:
    """The records of a file, those of its chunks in their places."""
    for record in StreamReader(io.BytesIO(content), emit_chunks=True).records:
        if not isinstance(record, Chunk):
            yield record
            continue
        inside = _unpacked(record, most)
        most -= len(inside)
        if most < 0:
            raise ValueError("it holds more bytes than allowed")
        stream = io.BytesIO(inside)
        records = StreamReader(stream, skip_magic=True).records
        while stream.tell() < len(inside):
            yield next(records)


def _unpacked(chunk: Chunk, most: int) -> bytes:
    """A chunk's records, cut at one byte beyond ``most``; what it says of its own size is not believed."""
    match chunk.compression:
        case "":
            return chunk.data
        case "zstd":
            return bytes(zstandard.ZstdDecompressor().stream_reader(chunk.data).read(most + 1))
        case "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=most + 1))
    raise ValueError(f"compression {chunk.compression!r}; allowed: zstd, lz4 or none")
