from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

with Path("runs/curve/run.mcap").open("rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    for _, channel, message, value in reader.iter_decoded_messages():
        print(message.log_time, channel.topic, value)
