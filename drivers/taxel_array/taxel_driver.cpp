#include "drivers/taxel_array/taxel_driver.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "drivers/api/config.hpp"
#include "protocols/taxel/taxel.hpp"

namespace weft::drivers {

namespace taxel = protocols::taxel;

namespace {
constexpr std::array<std::uint8_t, 1> hello{0};
/// An older frame by less than this arrived late. By more, it is the first of a restarted sensor.
constexpr std::uint32_t latest_us = 2'000'000;
constexpr int late_run_of_a_restart = 3;

constexpr std::uint32_t least_frames = 20;
/// Every AD7147 has noise of about a count (device-facts.md, CPM finger), so a taxel that never
/// changes is dead.
constexpr double noisy_counts = 200;  // mean change per frame that no fabric causes
constexpr double noisy_ratio = 10;    // multiple of the median taxel's change
Error fault(std::string message, std::string expected, std::string got, std::string hint) {
  return {.code = Errc::device_data,
          .what = std::move(message),
          .expected = std::move(expected),
          .got = std::move(got),
          .hint = std::move(hint)};
}

}  // namespace

FrameWatch::FrameWatch(const TaxelSettings& settings)
    : StreamWatch(
          {.rate_hz = settings.rate_hz,
           .window = settings.watch,
           .least_frames = least_frames,
           .has_clock = settings.form == TaxelForm::weft,  // frames carry the sensor's own time
           .rate_what = "rate of the array differs from the configuration",
           .rate_unit = "frames/s",
           .rate_hint = "Correct rate_hz in the rig file, or the settings of the sensor"}),
      has_noise_(settings.has_noise) {}

void FrameWatch::begin(const Frame& frame) {
  last_ = frame.counts;
  changes_ = {};
}

void FrameWatch::note(const Frame& frame) {
  for (std::size_t i = 0; i < frame.taxel_count; ++i) {
    const int change = std::abs(int{frame.counts[i]} - int{last_[i]});
    changes_[i].steps += change != 0 ? 1 : 0;
    changes_[i].path += change;
    changes_[i].largest = std::max(changes_[i].largest, static_cast<double>(change));
  }
  last_ = frame.counts;
}

std::optional<Error> FrameWatch::check_values(const Frame& frame) const {
  if (has_noise_)
    if (auto wrong = check_still(frame)) return wrong;
  return check_noise(frame);
}

std::optional<Error> FrameWatch::check_still(const Frame& frame) const {
  std::size_t still = 0, which = 0;
  for (std::size_t i = 0; i < frame.taxel_count; ++i) {
    if (changes_[i].steps != 0) continue;
    ++still;
    which = i;
  }
  if (still == 0) return std::nullopt;
  const char* hint = "Check the cable of the sensor; set watch_s to 0 for a sensor without noise";
  if (still == frame.taxel_count)
    return fault("frames frozen: no taxel changes", "noise",
                 std::to_string(frames()) + " equal frames", hint);
  const std::uint16_t at = frame.counts[which];
  return fault("taxel " + std::to_string(which + 1) +
                   (at == 0xFFFF ? " saturated" : " dead: its value does not change"),
               "noise", "always " + std::to_string(at) + " counts", hint);
}

std::optional<Error> FrameWatch::check_noise(const Frame& frame) const {
  std::array<double, taxel::max_taxels> paths{};
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    paths[i] = (changes_[i].path - changes_[i].largest) / frames();
  auto sorted = paths;
  const auto middle = sorted.begin() + frame.taxel_count / 2;
  std::nth_element(sorted.begin(), middle, sorted.begin() + frame.taxel_count);
  const double limit = std::max(noisy_counts, noisy_ratio * *middle);
  for (std::size_t i = 0; i < frame.taxel_count; ++i)
    if (paths[i] > limit)
      return fault(
          "taxel " + std::to_string(i + 1) + " noisy",
          "changes of about " + std::to_string(*middle) + " counts, as for the other taxels",
          std::to_string(paths[i]) + " counts from frame to frame",
          "Check the taxel and the shield");
  return std::nullopt;
}

TaxelDriver::TaxelDriver(const TaxelSettings& settings, DriverHost& driver_host)
    : ListeningDriver(driver_host, "a tactile array"), settings_(settings), watch_(settings) {}

Status TaxelDriver::open() noexcept {
  if (Status taken = attach(); !taken) return taken;
  splitter_.clear();
  sequence_.reset();
  frame_ = {};
  frame_.taxel_count = settings_.taxels;
  silence().expect_within(settings_.reply_timeout);
  watch_.restart();
  late_ = 0;
  // A gateway sends without a request; an emulated one learns the host's address from this.
  if (settings_.form == TaxelForm::cpm_udp && !send(hello))
    return fail({.code = Errc::io, .what = "first datagram not sent: the link did not accept it"});
  return {};
}

void TaxelDriver::await_frames() {
  silence().expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
}

void TaxelDriver::received(ByteView bytes, TimePoint arrival) {
  const bool stream = settings_.form == TaxelForm::weft;
  count_damaged(stream ? on_stream(bytes, arrival) : on_datagram(bytes, arrival), arrival);
}

std::uint64_t TaxelDriver::on_stream(ByteView bytes, TimePoint arrival) {
  const std::uint64_t before = splitter_.damaged();
  splitter_.push(bytes);
  while (attached() && splitter_.next(frame_)) on_frame(arrival);
  return splitter_.damaged() - before;
}

// The gateway sends no number: the driver counts and cannot detect losses.
std::uint64_t TaxelDriver::on_datagram(ByteView datagram, TimePoint arrival) {
  const Result<taxel::cpm::Counts> counts = taxel::cpm::decode_datagram(datagram);
  if (!counts) return 1;
  std::copy(counts->begin(), counts->end(), frame_.counts.begin());
  ++frame_.sequence;
  on_frame(arrival);
  return 0;
}

void TaxelDriver::on_frame(TimePoint arrival) {
  if (frame_.taxel_count != settings_.taxels) {
    raise({.code = Errc::device_settings,
           .where = "/taxels",
           .what = "number of taxels differs from the configuration",
           .expected = std::to_string(settings_.taxels),
           .got = std::to_string(frame_.taxel_count),
           .hint = "Correct the number of taxels in the rig file"});
    return;
  }
  const std::optional<std::uint32_t> lost = count_lost();
  if (!lost) return;
  if (state() == DriverState::closed) {
    silence().stop();
    host().identified({.reported = {{"taxels", std::to_string(frame_.taxel_count)}}, .scale = {}});
    return enter(LifecycleEvent::opened);
  }
  if (!advance(settings_.stale_after)) return;
  if (auto wrong = watch_.check(frame_, *lost, arrival)) return raise(*wrong);
  publish(*lost, arrival);
}

/// Number of lost frames; nullopt for a duplicate or late frame, which is dropped.
std::optional<std::uint32_t> TaxelDriver::count_lost() {
  const SequenceStep step = sequence_.observe(frame_.sequence);
  const bool older =
      step.event == SequenceEvent::out_of_order || step.event == SequenceEvent::duplicate;
  if (older && settings_.form == TaxelForm::weft && came_late()) {
    if (++late_ == 1) host().log(LogLevel::warning, "frame received twice or late; it was dropped");
    return std::nullopt;
  }
  late_in_a_row_ = 0;
  last_device_us_ = frame_.device_us;
  if (older) {
    watch_.restart();
    host().log(LogLevel::warning, "the array restarted: its frame numbers jumped back");
    sequence_.reset();
    sequence_.observe(frame_.sequence);
  }
  return step.lost;
}

/// Whether an older frame is late. Otherwise the sensor has restarted: its clock is far behind, or
/// such frames form a run.
bool TaxelDriver::came_late() {
  const bool next =
      late_in_a_row_ > 0 && frame_.sequence == static_cast<std::uint16_t>(last_late_ + 1);
  late_in_a_row_ = next ? late_in_a_row_ + 1 : 1;
  last_late_ = frame_.sequence;
  return last_device_us_ - frame_.device_us < latest_us && late_in_a_row_ < late_run_of_a_restart;
}

void TaxelDriver::publish(std::uint32_t lost, TimePoint arrival) {
  host().publish({arrival, frame_.sequence, lost,
                  TaxelSample{frame_.taxels(), frame_.proximity_counts, frame_.ambient_counts,
                              frame_.device_us}});
}

void TaxelDriver::on_silence() {
  raise({.code = Errc::timeout,
         .what = "no frame from the tactile array",
         .got = "nothing received",
         .hint = state() == DriverState::closed
                     ? "Check the port, the form and the power of the array"
                     : ""});
}

constinit const DriverEntry taxel_array_entry{
    .name = "taxel_array",
    .summary = "Tactile array over a serial line, or a CPM-Finger over its UDP gateway",
    .config_schema_json = taxel_config_schema,
    .create = create_driver<TaxelDriver, read_taxel_settings>,
};

const char taxel_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Tactile array",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "taxels": {"type": "integer", "minimum": 1, "maximum": 64, "default": 16, "description": "number of taxels; with rows and cols, their product"},
    "rows": {"type": "integer", "minimum": 1, "maximum": 64, "description": "rows of the array, as drawn on the page; taxels are sent row by row"},
    "cols": {"type": "integer", "minimum": 1, "maximum": 64, "description": "taxels per row"},
    "positions_mm": {"x-unit": "mm", "type": "array", "items": {"type": "number", "minimum": -1000, "maximum": 1000}, "description": "instead of rows and cols: x and y of each taxel from the middle of the face, as x1, y1, x2, y2, ..."},
    "span_counts": {"type": "integer", "minimum": 1, "maximum": 65535, "description": "largest rise of a taxel above its rest value, by calibration; sets the colour scale of the page and is not a limit"},
    "form": {"enum": ["weft", "cpm_udp"], "default": "weft", "description": "weft: serial frames of protocols/taxel; cpm_udp: datagrams from the gateway of the CPM-Finger, 16 taxels"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 1, "description": "longest wait for the first frame"},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0.1, "maximum": 10000, "default": 37, "description": "frames per second from the sensor"},
    "watch_s": {"x-unit": "s", "type": "number", "minimum": 0, "maximum": 3600, "default": 2, "description": "length of the windows in which dead, saturated and noisy taxels, rate and clock are checked; 0: no check"},
    "noise": {"enum": ["sensor", "none"], "default": "sensor", "description": "none: for a simulation without noise; constant taxels are then not a fault"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.01, "maximum": 60, "description": "longest time without a frame; default: ten periods of the stream, at least 0.3"}
  }
})";

namespace {

/// The count from the number, from rows and columns, or from places; they must agree.
std::uint8_t read_taxel_count(ConfigReader& config) {
  constexpr int most = taxel::max_taxels;
  const auto rows = config.integer("rows", 0, {1, most});
  const auto cols = config.integer("cols", 0, {1, most});
  const auto product = rows * cols;
  if ((rows == 0) != (cols == 0))
    config.refuse(rows == 0 ? "rows" : "cols", "key missing", "rows and cols, or none of them");
  if (product > most)
    config.refuse("rows", "too many taxels", "rows x cols of at most 64", std::to_string(product));
  const auto taxels = config.integer("taxels", product > 0 ? product : 16, {1, most});
  if (product > 0 && taxels != product)
    config.refuse("taxels", "number of taxels is not the product of rows and cols",
                  std::to_string(product), std::to_string(taxels));
  config.numbers("positions_mm", std::vector<double>(static_cast<std::size_t>(2 * taxels)),
                 {-1000, 1000});
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(taxels, 1, taxel::max_taxels));
}

}  // namespace

Result<TaxelSettings> read_taxel_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  TaxelSettings settings;
  settings.taxels = read_taxel_count(config);
  if (config.choice("form", "weft", {"weft", "cpm_udp"}) == "cpm_udp")
    settings.form = TaxelForm::cpm_udp;
  if (settings.form == TaxelForm::cpm_udp && settings.taxels != protocols::taxel::cpm::taxels)
    config.refuse("taxels", "number of taxels differs from the CPM-Finger", "16",
                  std::to_string(settings.taxels));
  config.integer("span_counts", 1, {1, 65535});
  const double rate_hz = config.number("rate_hz", 37, {0.1, 1e4});
  settings.rate_hz = rate_hz;
  settings.watch = from_seconds(config.number("watch_s", 2, {0, 3600}));
  settings.has_noise = config.choice("noise", "sensor", {"sensor", "none"}) == "sensor";
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 1, {0.01, 60}));
  settings.stale_after = from_seconds(
      config.number("stale_after_s", std::min(std::max(0.3, 10 / rate_hz), 60.0), {0.01, 60}));
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

}  // namespace weft::drivers
