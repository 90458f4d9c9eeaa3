"""How many bits a frame takes on the wire, stuff bits counted one by one (ISO 11898-1).

Stuffed is what stands from start of frame to the end of the CRC: after five equal bits one of the other level
follows, which counts for the next five. Behind it come CRC delimiter, acknowledge slot and delimiter, and seven
bits of end of frame, unstuffed; then three bits of interframe space, during which nobody may send.
"""

from __future__ import annotations

from .frames import Frame

__all__ = ["INTERFRAME_BITS", "frame_bits"]

INTERFRAME_BITS = 3
_TAIL_BITS = 10
_STUFF_RUN = 5
_CRC_POLYNOMIAL = 0x4599
_CRC_MASK = 0x7FFF
_ERROR_FRAME_BITS = 20  # six bits of error flag, up to six more of the others', eight of delimiter


def _crc15(value: int, width: int) -> int:
    crc = 0
    for at in range(width - 1, -1, -1):
        top = crc >> 14 ^ value >> at & 1
        crc = crc << 1 & _CRC_MASK
        if top:
            crc ^= _CRC_POLYNOMIAL
    return crc


def _stuff_bits(value: int, width: int) -> int:
    count, level, run = 0, -1, 0
    for at in range(width - 1, -1, -1):
        bit = value >> at & 1
        run = run + 1 if bit == level else 1
        level = bit
        if run == _STUFF_RUN:
            count += 1
            level, run = 1 - bit, 1
    return count


def frame_bits(frame: Frame) -> int:
    """Bits from start of frame to end of frame, without the interframe space: 108 to 132 for a base frame of 8
    bytes. An error frame counts with its longest form of 20 bits. Raises ValueError for CAN FD, which no bus at 1
    Mbit/s carries here."""
    if frame.error:
        return _ERROR_FRAME_BITS
    if frame.fd:
        raise ValueError("the length of a CAN FD frame depends on its two bit rates")
    remote = int(frame.remote)
    if frame.extended:
        # SOF, upper 11 bits, SRR and IDE recessive, lower 18 bits, RTR, r1, r0
        head = (frame.can_id >> 18) << 23 | 3 << 21 | (frame.can_id & 0x3FFFF) << 3 | remote << 2
        width = 35
    else:
        head = frame.can_id << 3 | remote << 2  # SOF, 11 bits, RTR, IDE, r0
        width = 15
    data = b"" if frame.remote else frame.data
    value = head << 4 | (frame.raw_dlc or frame.dlc)
    value = value << 8 * len(data) | int.from_bytes(data, "big")
    width += 4 + 8 * len(data)
    value = value << 15 | _crc15(value, width)
    width += 15
    return width + _stuff_bits(value, width) + _TAIL_BITS
