#include "drivers/imprint_array/imprint_driver.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/api/config.hpp"

namespace weft::drivers {

namespace imprint = protocols::imprint;

namespace {

constexpr double rate_tolerance = 1e-3;
/// Scans of another part that may still arrive after a request for a new part.
constexpr int most_foreign_scans = 3;
constexpr std::uint32_t least_scans = 10;  // minimum per window
/// At least this many taxels with noise of a fraction of a count never read the same for seconds.
constexpr std::size_t least_taxels = 64;

std::string format_text(const imprint::Window& window) {
  return std::to_string(window.rows) + " x " + std::to_string(window.cols) + " from row " +
         std::to_string(window.first_row) + ", column " + std::to_string(window.first_col);
}

}  // namespace

ScanWatch::ScanWatch(double rate_hz, Duration window)
    : StreamWatch({.rate_hz = rate_hz,
                   .window = window,
                   .least_frames = least_scans,
                   .rate_code = Errc::device_settings,
                   .rate_what = "scan rate of the array differs from the configuration",
                   .rate_unit = "scans/s",
                   .rate_hint = "Correct rate_hz in the rig file, or the settings of the array"}) {}

void ScanWatch::begin(const imprint::Frame& scan) {
  std::ranges::copy(scan.taxels(), first_.begin());
  changed_ = false;
}

void ScanWatch::note(const imprint::Frame& scan) {
  if (!changed_) changed_ = !std::equal(scan.taxels().begin(), scan.taxels().end(), first_.begin());
}

std::optional<Error> ScanWatch::check_values(const imprint::Frame& scan) const {
  if (changed_ || scan.taxels().size() < least_taxels) return std::nullopt;
  return Error{.code = Errc::device_data,
               .what = "scans frozen: no taxel changes",
               .expected = "noise",
               .got = std::to_string(frames()) + " equal scans",
               .hint = "Check the cable of the array; set watch_s to 0 for an array without noise"};
}

ImprintDriver::ImprintDriver(const ImprintSettings& settings, DriverHost& driver_host)
    : ListeningDriver(driver_host, "an imprint array"),
      settings_(settings),
      watch_(settings.rate_hz, settings.watch) {}

Status ImprintDriver::open() noexcept {
  if (Status taken = attach(); !taken) return taken;
  splitter_.clear();
  sequence_.reset();
  description_.reset();
  watch_.restart();
  foreign_scans_ = 0;
  silence().expect_within(settings_.reply_timeout);
  return {};
}

void ImprintDriver::await_frames() {
  watch_.restart();
  silence().expect_within(std::max(settings_.stale_after, settings_.reply_timeout));
}

void ImprintDriver::received(ByteView bytes, TimePoint arrival) {
  const std::uint64_t before = splitter_.damaged();
  splitter_.push(bytes);
  while (attached() && splitter_.next(frame_)) {
    if (frame_.kind == imprint::Kind::description) on_description();
    if (frame_.kind == imprint::Kind::scan && description_) on_scan(arrival);
  }
  count_damaged(splitter_.damaged() - before, arrival);
}

void ImprintDriver::on_description() {
  const imprint::Description& description_seen = frame_.description;
  if (description_) {
    if (*description_ == description_seen) return;
    return raise({.code = Errc::device_restarted,
                  .what = "description of the array changed after opening",
                  .expected = "serial " + std::to_string(description_->serial) + ", the same array",
                  .got = "serial " + std::to_string(description_seen.serial),
                  .hint = "Check whether the array was replaced or changed, then open it again"});
  }
  if (const auto wrong = unfit(description_seen)) return raise(*wrong);
  const auto window = window_on(settings_, description_seen.rows, description_seen.cols);
  if (!window) return raise(window.error());
  description_ = description_seen;
  window_ = *window;
  silence().expect_within(settings_.reply_timeout);
  request_window();
}

std::optional<Error> ImprintDriver::unfit(const imprint::Description& description_seen) const {
  if (settings_.serial != 0 && settings_.serial != description_seen.serial)
    return Error{.code = Errc::device_identity,
                 .where = "/serial",
                 .what = "serial number of the array differs from the configuration",
                 .expected = std::to_string(settings_.serial),
                 .got = std::to_string(description_seen.serial),
                 .hint = "Correct the rig file, or check which array is on this port"};
  if (description_seen.bits < 1 || description_seen.bits > 7 ||
      description_seen.full_scale_pa == 0 || description_seen.period_us == 0 ||
      description_seen.rows == 0 || description_seen.cols == 0 ||
      description_seen.rows > imprint::max_side || description_seen.cols > imprint::max_side)
    return Error{.code = Errc::device_data,
                 .what = "description of the array invalid",
                 .expected = "1 to 7 bits, a full scale, a period, 1 to 128 rows and columns",
                 .got = std::to_string(description_seen.bits) + " bits, " +
                        std::to_string(description_seen.full_scale_pa) + " Pa, " +
                        std::to_string(description_seen.period_us) + " us, " +
                        std::to_string(description_seen.rows) + " x " +
                        std::to_string(description_seen.cols),
                 .hint = "Check the firmware of the array"};
  const double rate_hz = 1e6 / description_seen.period_us;
  if (std::abs(rate_hz - settings_.rate_hz) <= rate_tolerance * settings_.rate_hz)
    return std::nullopt;
  return Error{.code = Errc::device_settings,
               .where = "/rate_hz",
               .what = "scan rate of the array differs from the configuration",
               .expected = std::to_string(settings_.rate_hz) + " scans/s",
               .got = std::to_string(rate_hz) + " scans/s",
               .hint = "Correct the rig file, or the settings of the array"};
}

void ImprintDriver::request_window() {
  imprint::Frame request;
  request.kind = imprint::Kind::request;
  request.sequence = requests_++;
  request.window = window_;
  Bytes bytes;
  append(bytes, request);
  static_cast<void>(send(bytes));
}

void ImprintDriver::on_scan(TimePoint arrival) {
  if (frame_.window != window_) return on_foreign_scan();
  foreign_scans_ = 0;
  const std::uint32_t lost = count_lost();
  if (state() == DriverState::closed) {
    silence().stop();
    report_identity();
    return enter(LifecycleEvent::opened);
  }
  if (!advance(settings_.stale_after)) return;
  if (auto wrong = watch_.check(frame_, lost, arrival)) return raise(*wrong);
  publish(lost, arrival);
}

/// Handles scans of another part: they were in progress when the part was requested, or the array
/// has lost the request.
void ImprintDriver::on_foreign_scan() {
  if (++foreign_scans_ > most_foreign_scans)
    return raise({.code = Errc::device_refused,
                  .where = "/rows",
                  .what = "wrong scan window",
                  .expected = format_text(window_),
                  .got = format_text(frame_.window),
                  .hint = "Close other programs that use the array"});
  if (state() != DriverState::closed) request_window();
}

/// The link keeps the order, so an older number shows that the array has restarted.
std::uint32_t ImprintDriver::count_lost() {
  const SequenceStep step = sequence_.observe(frame_.sequence);
  if (step.event != SequenceEvent::duplicate && step.event != SequenceEvent::out_of_order)
    return step.lost;
  watch_.restart();
  host().log(LogLevel::warning, "the array restarted: its scan numbers jumped back");
  sequence_.reset();
  sequence_.observe(frame_.sequence);
  return 0;
}

void ImprintDriver::publish(std::uint32_t lost, TimePoint arrival) {
  const auto taxels = frame_.taxels();
  std::ranges::copy(taxels, counts_.begin());
  host().publish({arrival, frame_.sequence, lost,
                  TaxelSample{std::span(counts_).first(taxels.size()), 0, 0, frame_.device_us}});
}

void ImprintDriver::report_identity() {
  const imprint::Description& description_seen = *description_;
  const auto text = [](auto number) { return std::to_string(number); };
  const auto& firmware = description_seen.firmware;
  DeviceIdentity identity;
  identity.reported = {
      {"serial", text(description_seen.serial)},
      {"firmware", text(firmware[0]) + "." + text(firmware[1]) + "." + text(firmware[2])},
      {"array", text(description_seen.rows) + " x " + text(description_seen.cols)},
      {"rows", text(window_.rows)},
      {"cols", text(window_.cols)},
      {"first_row", text(window_.first_row)},
      {"first_col", text(window_.first_col)},
      {"bits", text(description_seen.bits)},
      {"spacing_um", text(description_seen.spacing_um)}};
  const double highest = (1U << description_seen.bits) - 1;
  identity.scale = {{"pa_per_count", description_seen.full_scale_pa / highest}};
  host().identified(identity);
}

void ImprintDriver::on_silence() {
  const bool described = description_.has_value();
  raise(
      {.code = Errc::timeout,
       .what =
           described ? "no scan from the imprint array" : "no description from the imprint array",
       .expected = described ? "scans of " + format_text(window_) : "one each second",
       .got = "nothing received",
       .hint = state() == DriverState::closed ? "Check the port and the power of the array" : ""});
}

constinit const DriverEntry imprint_array_entry{
    .name = "imprint_array",
    .summary = "Dense array of taxels for static imprints, whole or a part of it",
    .config_schema_json = imprint_config_schema,
    .create = create_driver<ImprintDriver, read_imprint_settings>,
};

namespace imprint = protocols::imprint;

const char imprint_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Imprint array",
  "type": "object",
  "additionalProperties": false,
  "required": ["rows", "cols"],
  "properties": {
    "rows": {"type": "integer", "minimum": 1, "maximum": 128, "description": "number of scanned rows"},
    "cols": {"type": "integer", "minimum": 1, "maximum": 128, "description": "number of scanned columns"},
    "first_row": {"type": "integer", "minimum": 0, "maximum": 127, "description": "first scanned row; default: the scan window is in the middle of the array"},
    "first_col": {"type": "integer", "minimum": 0, "maximum": 127},
    "rate_hz": {"x-unit": "Hz", "type": "number", "minimum": 0.1, "maximum": 1000, "default": 5, "description": "scans per second"},
    "serial": {"type": "integer", "minimum": 0, "maximum": 4294967295, "default": 0, "description": "required serial number of the array; 0: any"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 3, "description": "longest wait for the description of the array, sent once per second, and then for the first scan"},
    "stale_after_s": {"x-unit": "s", "x-safety": true, "type": "number", "minimum": 0.01, "maximum": 60, "description": "longest time without a scan; default: five periods of the stream, at least 0.3"},
    "watch_s": {"x-unit": "s", "type": "number", "minimum": 0, "maximum": 3600, "default": 4, "description": "length of the windows in which frozen scans, rate and clock are checked; 0: no check"}
  }
})";

namespace {

constexpr double last_taxel = imprint::max_side - 1;
constexpr std::int64_t in_the_middle = -1;

std::uint8_t read_side(ConfigReader& config, const char* key) {
  constexpr std::int64_t missing = 0;
  const std::int64_t side = config.integer(key, missing, {1, double{imprint::max_side}});
  if (side == missing) config.refuse(key, "key missing", "1 to 128 taxels", "none");
  return static_cast<std::uint8_t>(side);
}

std::optional<std::uint8_t> read_first(ConfigReader& config, const char* key) {
  const std::int64_t first = config.integer(key, in_the_middle, {0, last_taxel});
  if (first == in_the_middle) return std::nullopt;
  return static_cast<std::uint8_t>(first);
}

}  // namespace

Result<ImprintSettings> read_imprint_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  ImprintSettings settings;
  settings.rows = read_side(config, "rows");
  settings.cols = read_side(config, "cols");
  settings.first_row = read_first(config, "first_row");
  settings.first_col = read_first(config, "first_col");
  settings.rate_hz = config.number("rate_hz", 5, {0.1, 1e3});
  settings.serial = static_cast<std::uint32_t>(config.integer("serial", 0, {0, 4294967295.0}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 3, {0.01, 60}));
  settings.stale_after = from_seconds(config.number(
      "stale_after_s", std::min(std::max(0.3, 5 / settings.rate_hz), 60.0), {0.01, 60}));
  settings.watch = from_seconds(config.number("watch_s", 4, {0, 3600}));
  const imprint::Window part{settings.first_row.value_or(0), settings.first_col.value_or(0),
                             settings.rows, settings.cols};
  if (settings.rows > 0 && settings.cols > 0 && !makes_sense(part))
    config.refuse("first_row", "scan window beyond the largest array", "rows and columns 0 to 127");
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

Result<imprint::Window> window_on(const ImprintSettings& settings, std::uint8_t rows,
                                  std::uint8_t cols) {
  const auto middle = [](int array, int part) {
    return static_cast<std::uint8_t>(std::max(0, (array - part) / 2));
  };
  const imprint::Window part{settings.first_row.value_or(middle(rows, settings.rows)),
                             settings.first_col.value_or(middle(cols, settings.cols)),
                             settings.rows, settings.cols};
  const auto size = [](int r, int c) { return std::to_string(r) + " x " + std::to_string(c); };
  if (part.first_row + part.rows > rows || part.first_col + part.cols > cols)
    return fail({.code = Errc::device_settings,
                 .where = "/rows",
                 .what = "scan window outside the array",
                 .expected = "within " + size(rows, cols),
                 .got = size(part.rows, part.cols) + " from row " + std::to_string(part.first_row) +
                        ", column " + std::to_string(part.first_col),
                 .hint = "Correct the rig file, or check which array is on this port"});
  return part;
}

}  // namespace weft::drivers
