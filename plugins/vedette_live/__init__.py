"""Live runs: streams in, tracks out; inputs, outputs, formats and a store, and the commands serve and replay."""

from collections.abc import Iterable

from vedette.config import plugin
from vedette.roles import Component
from vedette_live.commands import Replay, Serve
from vedette_live.formats.asterix import Asterix
from vedette_live.formats.csv_lines import CsvLines
from vedette_live.formats.geojson import GeoJson
from vedette_live.formats.json_lines import JsonLines
from vedette_live.formats.nmea import Nmea
from vedette_live.inputs.files import FileInput, StandardInput
from vedette_live.inputs.mqtt import MqttInput
from vedette_live.inputs.tcp import TcpClientInput, TcpServerInput
from vedette_live.inputs.udp import UdpInput
from vedette_live.outputs.files import FileOutput, StandardOutput
from vedette_live.outputs.sockets import MqttOutput, TcpClientOutput, TcpServerOutput, UdpOutput
from vedette_live.outputs.websocket import WebSocketOutput
from vedette_live.sources.stream import StreamSource
from vedette_live.stores.sqlite import SqliteStore

VEDETTE_CONTRACT = 2


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return commands, inputs, formats, outputs and the store."""
    return [
        Serve, Replay,
        JsonLines, CsvLines, Nmea, Asterix, GeoJson,
        StandardInput, FileInput, UdpInput, TcpServerInput, TcpClientInput, MqttInput,
        StandardOutput, FileOutput, UdpOutput, TcpServerOutput, TcpClientOutput, MqttOutput, WebSocketOutput,
        SqliteStore, StreamSource,
    ]  # fmt: skip
