#!/usr/bin/env python3
"""Messages of each channel of a log, counted one by one with the PyPI library `mcap`.

usage: independent_counts.py LOG

Prints a JSON object: channel id -> [count, first log time, last log time], ns as strings.
"""

import json
import sys

from mcap.reader import NonSeekingReader

counts = {}
with open(sys.argv[1], "rb") as file:
    for _, channel, message in NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False):
        count, first, last = counts.get(channel.id, (0, message.log_time, message.log_time))
        counts[channel.id] = (count + 1, min(first, message.log_time), max(last, message.log_time))
print(json.dumps({str(i): [n, str(first), str(last)] for i, (n, first, last) in counts.items()}))
