// Bytes of a Digital F/T sensor: as a stream in any chunking, and as the registers of a
// calibration.

#include <algorithm>
#include <array>
#include <cmath>

#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "tests/fuzz/chunked.hpp"

namespace weft::fuzz::ati_digital_target {
namespace {

using namespace weft::protocols::ati_digital;

/// A record and the number of records lost before it.
struct Found {
  StreamRecord record;
  std::uint32_t lost = 0;
  bool operator==(const Found&) const = default;
};

struct Records {
  StreamSplitter splitter;
  explicit Records(bool in_step) { in_step ? splitter.begin_in_step() : splitter.begin_anywhere(); }
  void push(ByteView bytes) { splitter.push(bytes); }
  bool next(Found& found) { return splitter.next(found.record, found.lost); }
};

/// At once, in pieces chosen by the input, and byte by byte.
void try_stream(ByteView bytes, ByteView sizes, bool in_step) {
  Records whole(in_step);
  const auto at_once = split<Found>(whole, bytes, {});
  constexpr std::array<std::uint8_t, 1> single{1};
  for (const ByteView some : {sizes, ByteView(single)}) {
    Records pieces(in_step);
    demand(at_once == split<Found>(pieces, bytes, some), "any chunking gives the same records");
    demand(whole.splitter.dropped_bytes() == pieces.splitter.dropped_bytes(),
           "any chunking drops the same bytes");
  }
  demand(at_once.size() * record_size + whole.splitter.dropped_bytes() <= bytes.size(),
         "no byte is counted twice");
}

void read_calibration(ByteView bytes) {
  CalibrationRegisters registers{};
  BigReader reader(bytes);
  for (std::uint16_t& value : registers) value = reader.read<std::uint16_t>();
  const auto calibration = decode_calibration(registers);
  demand(calibration.has_value(), "168 registers are a calibration");
  const CalibrationRegisters written = encode(*calibration);
  demand(encode(decode_calibration(written).value()) == written,
         "a calibration that was written comes back");
  const auto matrix = gauge_matrix(*calibration);
  if (!matrix) return demand(!matrix.error().what.empty(), "an error says what is wrong");
  for (const double value : matrix->wrench({32767, -32768, 1, 0, -1, 32767}))
    demand(std::isfinite(value), "a matrix that is accepted gives finite forces");
}

}  // namespace

WEFT_FUZZ_TARGET(ati_digital) {
  using namespace weft::fuzz;
  using weft::protocols::ati_digital::StreamSplitter;
  const ChunkedInput input({data, size});
  const auto bytes = input.stream.first(std::min(input.stream.size(), StreamSplitter::capacity));
  for (const bool in_step : {true, false}) try_stream(bytes, input.sizes, in_step);
  read_calibration({data, size});
  return 0;
}

}  // namespace weft::fuzz::ati_digital_target
