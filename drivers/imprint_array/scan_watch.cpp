#include "drivers/imprint_array/scan_watch.hpp"

#include <algorithm>
#include <string>

namespace weft::drivers {

namespace imprint = protocols::imprint;

namespace {
constexpr std::uint32_t least_scans = 10;
/// So many taxels with noise of a fraction of a count never read the same for seconds.
constexpr std::size_t least_taxels = 64;
}  // namespace

void ScanWatch::begin(const imprint::Frame& scan, TimePoint arrival) {
  from_ = arrival;
  first_us_ = scan.device_us;
  std::ranges::copy(scan.taxels(), first_.begin());
  changed_ = false;
  scans_ = 0;
  expected_scans_ = 0;
}

std::optional<Error> ScanWatch::check(const imprint::Frame& scan, std::uint32_t lost,
                                      TimePoint arrival) {
  if (window_ <= Duration::zero()) return std::nullopt;
  if (!from_) {
    rate_.drop();
    clock_.drop();
    begin(scan, arrival);
    return std::nullopt;
  }
  ++scans_;
  expected_scans_ += 1.0 + lost;
  if (!changed_) changed_ = !std::equal(scan.taxels().begin(), scan.taxels().end(), first_.begin());
  if (scans_ < least_scans || arrival - *from_ < window_) return std::nullopt;
  auto wrong = evaluate(scan, to_seconds(arrival - *from_));
  begin(scan, arrival);
  return wrong;
}

std::optional<Error> ScanWatch::evaluate(const imprint::Frame& scan, double seconds) {
  if (!changed_ && scan.taxels().size() >= least_taxels)
    return Error{.code = Errc::device_data,
                 .what = "the scans are frozen: no taxel changes",
                 .expected = "the noise that taxels have",
                 .got = std::to_string(scans_) + " equal scans",
                 .hint = "Look at the array's cable; watch_s 0 is for an array without noise"};
  const double seen_hz = expected_scans_ / seconds;
  if (rate_.confirmed(seen_hz, rate_hz_))
    return Error{.code = Errc::device_settings,
                 .what = "the array scans at another rate than configured",
                 .expected = std::to_string(rate_hz_) + " scans/s",
                 .got = std::to_string(seen_hz) + " scans/s",
                 .hint = "Correct rate_hz in the rig file, or look at the array's settings"};
  return check_clock(clock_, static_cast<std::uint32_t>(scan.device_us - first_us_) * 1e-6,
                     seconds);
}

}  // namespace weft::drivers
