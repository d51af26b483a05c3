#include <cmath>

#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/recorder.hpp"

namespace weft::daemon {

std::uint64_t forecast_bytes(const RecordingForecast& forecast) {
  const auto bytes_per_s = [](double rate_hz, Stream stream, std::size_t width) {
    return rate_hz * static_cast<double>(row_bytes(stream, width));
  };
  // Four bytes a value; a fifth for the heads of blocks.
  const double vibration_bytes_per_s =
      1.2 * 4 *
      (static_cast<double>(acceleration_axes) * forecast.acceleration_rate_hz +
       forecast.sound_rate_hz);
  const double sample_bytes =
      forecast.trials * forecast.trial_duration_s *
      (bytes_per_s(forecast.taxel_rate_hz, Stream::taxel, forecast.taxels) +
       bytes_per_s(forecast.wrench_rate_hz, Stream::wrench, 6) +
       bytes_per_s(forecast.stage_rate_hz, Stream::stages, forecast.axes) + vibration_bytes_per_s);
  // The HDF5 file is never larger than the samples; a tenth for catalogue, page slack and journal;
  // the write-ahead log is folded in every 32 MB but grows while a reader holds it back.
  constexpr double fixed_bytes = 64e6;
  return static_cast<std::uint64_t>(std::ceil(2.1 * sample_bytes + fixed_bytes));
}

Status check_space(const std::filesystem::path& folder, std::uint64_t needed_bytes) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = folder.string(),
                 .what = "cannot tell the free space",
                 .got = error.message()});
  if (space.available < needed_bytes)
    return fail({.code = Errc::no_space,
                 .where = folder.string(),
                 .what = "not enough free space",
                 .expected = std::to_string(needed_bytes) + " bytes",
                 .got = std::to_string(space.available) + " bytes",
                 .hint = "Free some space or choose another folder"});
  return {};
}

}  // namespace weft::daemon
