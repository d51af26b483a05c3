// Bytes of a Digital F/T sensor: as a stream in any chunking, and as the registers of a
// calibration.

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz {
namespace {

using namespace weft::protocols::ati_digital;

struct Split {
  std::vector<StreamRecord> records;
  std::vector<std::uint32_t> lost;
  bool operator==(const Split&) const = default;
};

Split split(ByteView bytes, std::size_t piece, bool in_step) {
  StreamSplitter splitter;
  in_step ? splitter.begin_in_step() : splitter.begin_anywhere();
  Split out;
  StreamRecord record;
  std::uint32_t lost = 0;
  for (; !bytes.empty(); bytes = bytes.subspan(std::min(piece, bytes.size()))) {
    splitter.push(bytes.first(std::min(piece, bytes.size())));
    while (splitter.next(record, lost)) {
      out.records.push_back(record);
      out.lost.push_back(lost);
    }
  }
  return out;
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
  if (!matrix) return demand(!matrix.error().message.empty(), "an error says what is wrong");
  for (const double value : matrix->wrench({32767, -32768, 1, 0, -1, 32767}))
    demand(std::isfinite(value), "a matrix that is accepted gives finite forces");
}

}  // namespace
}  // namespace weft::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace weft::fuzz;
  using weft::protocols::ati_digital::StreamSplitter;
  const weft::ByteView bytes(data, std::min<std::size_t>(size, StreamSplitter::capacity));
  for (const bool in_step : {true, false}) {
    const Split whole = split(bytes, bytes.size(), in_step);
    demand(whole == split(bytes, 1, in_step), "any chunking gives the same records");
    demand(whole.records.size() * weft::protocols::ati_digital::record_size <= bytes.size(),
           "no more records than bytes");
  }
  read_calibration(bytes);
  return 0;
}
