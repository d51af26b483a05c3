#include "daemon/campaign/attempt_quality.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft::daemon {
namespace {

constexpr std::uint16_t full_scale = 0xFFFF;
// Links deliver samples in batches: a silence up to the longer of these is not a loss yet.
constexpr double timeout_s = 0.1;
constexpr double timeout_samples = 4;

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::string percent_text(double fraction) {
  const double tenths = std::round(fraction * 1e3);
  const auto whole = static_cast<std::uint64_t>(tenths);
  return std::to_string(whole / 10) + "." + std::to_string(whole % 10) + " %";
}

Error bad(std::string what, std::string where, std::string expected, std::string got,
          std::string hint) {
  return {.code = Errc::measurement,
          .where = std::move(where),
          .what = std::move(what),
          .expected = std::move(expected),
          .got = std::move(got),
          .hint = std::move(hint)};
}

}  // namespace

AttemptQualityCheck::AttemptQualityCheck(const recipes::RepeatBad& limits, double taxel_rate_hz,
                                         double wrench_rate_hz)
    : limits_(limits),
      still_frames_(static_cast<std::uint32_t>(std::ceil(limits.still_taxel_s * taxel_rate_hz))) {
  frames_.rate_hz = taxel_rate_hz;
  readings_.rate_hz = wrench_rate_hz;
}

std::uint64_t AttemptQualityCheck::Arrived::lost_by(TimePoint now) const {
  const double silent_s = to_seconds(now - due_from);
  const bool long_ago = silent_s > std::max(timeout_s, timeout_samples / rate_hz);
  return long_ago ? static_cast<std::uint64_t>(silent_s * rate_hz) : 0;
}

void AttemptQualityCheck::Arrived::add(const Sample& sample) {
  ++samples;
  lost += waits ? std::max<std::uint64_t>(sample.lost, lost_by(sample.host)) : sample.lost;
  due_from = sample.host;
  waits = false;
}

void AttemptQualityCheck::Arrived::pause(TimePoint now) {
  if (samples > 0) lost += lost_by(now);
}

void AttemptQualityCheck::begin() {
  taxels_.clear();
  for (Arrived* const sensor : {&frames_, &readings_}) *sensor = {.rate_hz = sensor->rate_hz};
}

void AttemptQualityCheck::check(const Sample& sample) {
  if (const auto* frame = std::get_if<TaxelSample>(&sample.value)) {
    frames_.add(sample);
    check(*frame);
  } else if (std::holds_alternative<WrenchSample>(sample.value)) {
    readings_.add(sample);
  }
}

void AttemptQualityCheck::resume(TimePoint now) {
  for (Arrived* const sensor : {&frames_, &readings_}) {
    sensor->due_from = now;
    sensor->waits = true;
  }
}

void AttemptQualityCheck::pause(TimePoint now) {
  frames_.pause(now);
  readings_.pause(now);
}

void AttemptQualityCheck::check(const TaxelSample& frame) {
  taxels_.resize(frame.counts.size());
  for (std::size_t i = 0; i < frame.counts.size(); ++i) {
    Taxel& taxel = taxels_[i];
    const std::uint16_t count = frame.counts[i];
    taxel.still = taxel.still > 0 && count == taxel.last ? taxel.still + 1 : 1;
    taxel.longest_still = std::max(taxel.longest_still, taxel.still);
    taxel.full += count == full_scale ? 1 : 0;
    taxel.last = count;
  }
}

std::optional<Error> AttemptQualityCheck::lost_samples() const {
  for (const auto& [name, arrived] :
       {std::pair{"taxel frames", frames_}, std::pair{"force readings", readings_}}) {
    const double lost = share(arrived.lost, arrived.samples + arrived.lost);
    if (lost > limits_.lost_fraction)
      return bad(std::string(name) + " lost", {}, "at most " + percent_text(limits_.lost_fraction),
                 percent_text(lost) + " (" + std::to_string(arrived.lost) + " samples)",
                 "Check the cable of the sensor and other traffic on its link");
  }
  return std::nullopt;
}

std::optional<Error> AttemptQualityCheck::bad_taxel() const {
  for (std::size_t i = 0; i < taxels_.size(); ++i) {
    const Taxel& taxel = taxels_[i];
    const std::string where = "taxel " + std::to_string(i + 1);  // people count from 1
    const double full = share(taxel.full, frames_.samples);
    if (full > limits_.saturated_fraction)
      return bad("taxel saturated", where,
                 "at most " + percent_text(limits_.saturated_fraction) + " of the frames",
                 percent_text(full), "Check the taxel, or press with less force");
    if (taxel.longest_still >= still_frames_)
      return bad("taxel value does not change", where,
                 "fewer than " + std::to_string(still_frames_) + " equal frames in a row",
                 std::to_string(taxel.longest_still),
                 "Check the taxel and the cable of the sensor");
  }
  return std::nullopt;
}

std::optional<Error> AttemptQualityCheck::verdict(double in_band_fraction) const {
  if (auto lost = lost_samples()) return lost;
  if (auto taxel = bad_taxel()) return taxel;
  if (in_band_fraction < limits_.force_in_band_fraction)
    return bad("force outside its band", "while it was held",
               "at least " + percent_text(limits_.force_in_band_fraction) + " within the band",
               percent_text(in_band_fraction), "Check the probe mount, or increase force_band_N");
  return std::nullopt;
}

}  // namespace weft::daemon
