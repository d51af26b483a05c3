"""pymodbus from PyPI reads and writes the registers of the emulated Digital F/T sensor."""
import json
import pathlib
import socket
import struct
import tempfile

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.pdu import ModbusPDU

from digital_ft import near_truth, s16
from emulated_support import ServedRig, digital_rig, free_port
from pypi_stages import until


class Answer(ModbusPDU):
    """One byte of data, as in requests and answers of the vendor's functions."""

    rtu_frame_size = 5
    data = 0

    def encode(self):
        return bytes([self.data])

    def decode(self, data):
        self.data = data[0]


class Lock(Answer):
    function_code = 0x6A


def registers(t, served, client, who):
    """A Digital F/T sensor: calibration in blocks, gauges, status, and settings written singly and in a block."""
    def holding(address, count):
        said = client.read_holding_registers(address, count=count, device_id=10)
        t.expect(not said.isError() and len(said.registers) == count, f"{who}: {count} registers at {address:#x}: {said}")
        return said.registers

    def refused(said, code):
        t.expect(said.isError() and said.exception_code == code, f"{who}: {said}, not exception {code}")

    def set_lock(data):
        order = Lock(dev_id=10)
        order.data = data
        t.expect(client.execute(False, order).data == 1, f"{who}: 0x6A {data:#x}")

    t.expect(client.connect(), f"{who}: connects")
    client.register(Lock)
    calibration = holding(0xE3, 64) + holding(0x123, 64) + holding(0x163, 40)
    t.expect(struct.pack(">4H", *calibration[:4]) == b"FT40001\0", f"{who}: serial number of the calibration")
    near_truth(t, who, calibration, s16(client.read_input_registers(0, count=6, device_id=10).registers))
    t.expect(holding(0x1D, 1) == [0], f"{who}: status 0")
    gains, offsets = calibration[121:127], calibration[127:133]
    t.expect(holding(0, 12) == gains + offsets, f"{who}: the calibration's gains and offsets are active")
    refused(client.write_register(0, gains[0] + 1, device_id=10), 4)
    refused(client.read_holding_registers(0x0CE3, count=1, device_id=10), 2)
    set_lock(0xAA)
    t.expect(not client.write_register(0, gains[0] + 1, device_id=10).isError(), f"{who}: one register written")
    t.expect(holding(0, 1) == [gains[0] + 1], f"{who}: one register as written")
    turned = [g + 2 + i for i, g in enumerate(gains)]
    t.expect(not client.write_registers(0, turned, device_id=10).isError(), f"{who}: six registers written")
    t.expect(holding(0, 12) == turned + offsets, f"{who}: six registers as written, the rest as they were")
    client.write_registers(0, gains, device_id=10)
    refused(client.write_register(0x1F, 9, device_id=10), 3)
    set_lock(0x18)
    refused(client.write_registers(0, turned, device_id=10), 4)
    t.expect(holding(0, 6) == gains, f"{who}: locked, and written")
    assert served.order(order="fault", device="ft", fault="status_bits")["ok"]
    until(lambda: holding(0x1D, 1) != [0], f"{who}: status with a fault", 5)
    assert served.order(order="clear", device="ft")["ok"]
    until(lambda: holding(0x1D, 1) == [0], f"{who}: status without it", 5)
    client.close()
    t.expect(client.connect() and holding(0x0C, 1) == [1], f"{who}: connects again")
    client.close()


def digital(t, program, root, framing):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        port = free_port(socket.SOCK_STREAM)
        over_tcp = {"kind": "tcp", "host": "127.0.0.1", "port": port}
        terminal = {"kind": "serial", "path": str(folder / "ft"), "baud": 1250000}
        path, rig = digital_rig(root, folder, framing, over_tcp if framing == "tcp" else terminal)
        if framing == "rtu":
            next(d for d in rig["devices"] if d["name"] == "ft")["also"] = [over_tcp]
            path.write_text(json.dumps(rig))
        with ServedRig(program, path, rig) as served:
            if framing == "tcp":
                registers(t, served, ModbusTcpClient("127.0.0.1", port=port, timeout=2), "pymodbus, Modbus TCP")
                return
            registers(t, served, ModbusSerialClient(terminal["path"], baudrate=115200, parity="N", timeout=2), "pymodbus, RTU")
            registers(t, served, ModbusTcpClient("127.0.0.1", port=port, framer=FramerType.RTU, timeout=2), "pymodbus, RTU over TCP")
