// Prints the readings of a Digital F/T sensor by a client of libmodbus as one JSON object:
//   libmodbus_client rtu PATH | tcp HOST PORT
// Reads status, calibration 1 and gauges; over RTU writes the gains, reads them back, and takes a
// few records of the stream.

#include <modbus/modbus.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace {

constexpr int slave = 10;
constexpr std::size_t record_size = 13, records = 8;

struct Close {
  void operator()(modbus_t* line) const {
    modbus_close(line);
    modbus_free(line);
  }
};
using Line = std::unique_ptr<modbus_t, Close>;

void demand(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "libmodbus_client: %s: %s\n", what, modbus_strerror(errno));
  std::exit(1);
}

std::vector<std::uint16_t> holding(modbus_t* line, int address, int count) {
  std::vector<std::uint16_t> out(static_cast<std::size_t>(count));
  demand(modbus_read_registers(line, address, count, out.data()) == count, "read holding");
  return out;
}

void print(const char* name, const std::vector<std::uint16_t>& values, const char* end = ",") {
  std::printf("\"%s\":[", name);
  for (std::size_t i = 0; i < values.size(); ++i) std::printf("%s%d", i == 0 ? "" : ",", values[i]);
  std::printf("]%s\n", end);
}

/// A vendor function: one byte in each direction (device-facts.md, Serial ports: libmodbus expects
/// 5 bytes for an unknown code, and returns exceptions unchanged).
int vendor(modbus_t* line, std::uint8_t function, std::uint8_t data) {
  const std::array<std::uint8_t, 3> request{slave, function, data};
  std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> reply{};
  demand(modbus_send_raw_request(line, request.data(), request.size()) > 0, "send");
  demand(modbus_receive_confirmation(line, reply.data()) == 5, "answer to a vendor function");
  return reply[1] == function ? reply[2] : -1;
}

void write_gains(modbus_t* line, const std::vector<std::uint16_t>& calibration) {
  const std::vector<std::uint16_t> gains(calibration.begin() + 121, calibration.begin() + 127);
  demand(modbus_write_registers(line, 0, 6, gains.data()) == -1, "a write while locked is refused");
  demand(vendor(line, 0x6A, 0xAA) == 1, "unlock");
  demand(modbus_write_registers(line, 0, 6, gains.data()) == 6, "write gains");
  demand(modbus_write_register(line, 0x1F, 2) == 1, "write the speed's index");
  demand(vendor(line, 0x6A, 0x18) == 1, "lock");
  demand(holding(line, 0, 6) == gains, "gains as written");
}

/// Raw records after the answer, then jamming traffic.
std::vector<std::uint16_t> stream(modbus_t* line) {
  demand(vendor(line, 0x46, 0x55) == 1, "start streaming");
  std::vector<std::uint16_t> bytes;
  const int port = modbus_get_socket(line);
  while (bytes.size() < records * record_size) {
    pollfd ready{port, POLLIN, 0};
    demand(::poll(&ready, 1, 2000) == 1, "records come");
    std::array<std::uint8_t, 64> some{};
    const ssize_t got = ::read(port, some.data(), some.size());
    demand(got >= 0, "read the stream");
    bytes.insert(bytes.end(), some.begin(), some.begin() + got);
  }
  const std::array<std::uint8_t, 14> jam{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
  demand(::write(port, jam.data(), jam.size()) == 14, "jam");
  bytes.resize(records * record_size);
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "libmodbus_client rtu PATH | tcp HOST PORT\n"), 2;
  const bool rtu = std::string(argv[1]) == "rtu";
  if (!rtu && argc < 4) return 2;
  // No parity, because a pseudo-terminal has none.
  const Line line(rtu ? modbus_new_rtu(argv[2], 115200, 'N', 8, 1)
                      : modbus_new_tcp(argv[2], std::atoi(argv[3])));
  demand(line != nullptr && modbus_set_slave(line.get(), slave) == 0, "create");
  demand(modbus_connect(line.get()) == 0, "connect");
  modbus_set_response_timeout(line.get(), 2, 0);
  std::printf("{");
  print("status", holding(line.get(), 0x1D, 1));
  std::vector<std::uint16_t> calibration;
  for (const auto& [at, count] : {std::pair{0xE3, 64}, {0x123, 64}, {0x163, 40}}) {
    const auto piece = holding(line.get(), at, count);
    calibration.insert(calibration.end(), piece.begin(), piece.end());
  }
  print("calibration", calibration);
  std::vector<std::uint16_t> gauges(6);
  demand(modbus_read_input_registers(line.get(), 0, 6, gauges.data()) == 6, "read input");
  if (rtu) write_gains(line.get(), calibration);
  if (rtu) print("stream", stream(line.get()));
  demand(rtu || modbus_read_registers(line.get(), 0x0CE3, 1, gauges.data()) == -1,
         "an address beyond the last is refused");
  print("gauges", gauges, "}");
  return 0;
}
