#include "daemon/storage/certificate/samples_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <ostream>

#include "daemon/storage/dataset/dataset_hasher.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/trial_reader.hpp"

namespace weft::daemon {
namespace {

constexpr unsigned second_digits = 9, force_digits = 6, position_digits = 9, angle_digits = 8,
                   vibration_digits = 6;
constexpr std::int64_t ns_per_s = 1'000'000'000;

/// `number` x 10^-`digits`, exact: "-0.004000".
void append_decimal(std::string& text, std::int64_t number, unsigned digits) {
  std::string all = std::to_string(number < 0 ? -number : number);
  if (all.size() <= digits) all.insert(0, digits + 1 - all.size(), '0');
  if (number < 0) text += '-';
  text.append(all, 0, all.size() - digits).append(".").append(all, all.size() - digits);
}

void append_shortest(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  static_cast<void>(error);  // a double has at most 24 characters
  text.append(digits.data(), end);
}

/// Phase of the newest frame at a given time, or "-" if that frame is more than two periods old: no
/// frames are recorded between phases.
class PhaseAt {
 public:
  PhaseAt(const classifier::Trial& trial, const TrialRecord& record, const DatasetInfo& info)
      : phases_(&trial.phase), times_(&record.t_ns) {
    const double rate_hz = trial.taxels > 0 ? info.taxel_rate_hz : info.wrench_rate_hz;
    if (rate_hz > 0) oldest_ns_ = std::llround(2e9 / rate_hz);
  }
  /// Times must not decrease from call to call.
  char operator()(std::int64_t t_ns) {
    while (next_ < times_->size() && (*times_)[next_] <= t_ns) ++next_;
    if (next_ == 0 || t_ns - (*times_)[next_ - 1] > oldest_ns_) return '-';
    return to_char((*phases_)[next_ - 1]);
  }

 private:
  const std::vector<Phase>* phases_;
  const std::vector<std::int64_t>* times_;
  std::size_t next_ = 0;
  std::int64_t oldest_ns_ = std::numeric_limits<std::int64_t>::max();
};

/// Rows of one trial.
struct TrialRows {
  const DatasetInfo& info;
  const classifier::Trial& trial;
  const TrialRecord& record;
  std::string begin;  ///< start of each row, up to the phase
  PhaseAt phase_at;
  std::string text = {};

  void row(std::int64_t t_ns) {
    ((text += begin) += phase_at(t_ns)) += ',';
    append_decimal(text, t_ns, second_digits);
  }
  void value(std::int64_t quanta, unsigned digits) {
    text += ',';
    append_decimal(text, quanta, digits);
  }

  void taxels() {
    for (std::size_t i = 0; i < trial.samples(); ++i) {
      row(record.t_ns[i]);
      for (const double counts : trial.row(i)) {
        text += ',';
        append_shortest(text, counts);
      }
      text += '\n';
    }
  }
  void wrench() {
    for (std::size_t i = 0; i < record.wrench.samples(); ++i) {
      row(record.wrench.t_ns[i]);
      for (std::size_t k = 0; k < 6; ++k) value(record.wrench.quanta[i * 6 + k], force_digits);
      text += '\n';
    }
  }
  void stages() {
    const std::size_t width = info.axes.size();
    for (std::size_t i = 0; i < record.stages.samples(); ++i) {
      row(record.stages.t_ns[i]);
      for (std::size_t k = 0; k < width; ++k)
        value(record.stages.quanta[i * width + k],
              info.axes[k].rotary ? angle_digits : position_digits);
      text += '\n';
    }
  }
  /// A block arrives after its last reading, so earlier readings are dated back.
  void blocks(const BlockStream& stream, const BlockFormat& format, std::size_t axes) {
    for (std::size_t i = 0; i < stream.blocks() * format.readings; ++i) {
      const std::size_t block = i / format.readings, k = i % format.readings;
      const double before_s = static_cast<double>(format.readings - 1 - k) / format.rate_hz;
      row(stream.t_ns[block] - std::llround(before_s * static_cast<double>(ns_per_s)));
      for (std::size_t axis = 0; axis < axes; ++axis)
        value(stream.quanta[i * axes + axis], vibration_digits);
      text += '\n';
    }
  }
};

void append_rows(TrialRows& rows, Stream stream) {
  switch (stream) {
    case Stream::taxel:
      return rows.taxels();
    case Stream::wrench:
      return rows.wrench();
    case Stream::stages:
      return rows.stages();
    case Stream::acceleration:
      return rows.blocks(rows.record.acceleration, rows.info.acceleration, acceleration_axes);
    case Stream::sound:
      return rows.blocks(rows.record.sound, rows.info.sound, 1);
  }
}

/// Names and units of the values; empty if the campaign has no such stream.
std::string value_columns(const DatasetInfo& info, std::size_t taxels, Stream stream) {
  std::string out;
  switch (stream) {
    case Stream::taxel:
      for (std::size_t i = 1; i <= taxels; ++i) out += ",ch" + std::to_string(i) + "_counts";
      break;
    case Stream::wrench:
      if (info.wrench_rate_hz > 0) out = ",fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm";
      break;
    case Stream::stages:
      for (const Axis& axis : info.axes) out += "," + axis.name + (axis.rotary ? "_rad" : "_m");
      break;
    case Stream::acceleration:
      if (info.acceleration.readings > 0) out = ",ax_mps2,ay_mps2,az_mps2";
      break;
    case Stream::sound:
      if (info.sound.readings > 0) out = ",sound_Pa";
      break;
  }
  return out;
}

std::string begin_of_row(const DatasetInfo& info, const classifier::Trial& trial,
                         const TrialSpec& spec) {
  return std::string(to_string(info.kind)) + "," + csv_field(trial.file) + "," +
         csv_field(trial.label) + "," + csv_field(spec.exploration) + "," +
         std::to_string(spec.repetition) + ",";
}

}  // namespace

const std::vector<std::string_view>& sample_stream_names() {
  static const std::vector<std::string_view> names{"taxels", "wrench", "stages", "acceleration",
                                                   "sound"};
  return names;
}

std::optional<Stream> sample_stream_from(std::string_view name) {
  const auto& names = sample_stream_names();
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Stream>(found - names.begin());
}

Result<WrittenSamples> write_samples_csv(const std::filesystem::path& campaign, Stream stream,
                                         std::ostream& out, const StopRequested& stop_requested) {
  const auto header = load_header(campaign);
  if (!header) return pass(header.error());
  auto listed = load_attempts(campaign, {.has_samples = false});
  if (!listed) return pass(listed.error());
  const DatasetInfo& info = listed->info;
  const std::string columns = value_columns(info, header->taxels, stream);
  const std::string name(sample_stream_names()[static_cast<std::size_t>(stream)]);
  if (columns.empty())
    return fail({.code = Errc::not_found,
                 .where = campaign.string(),
                 .what = "campaign does not have this stream",
                 .got = name});
  WrittenSamples written{std::string(to_string(info.kind)), {}, 0};
  written.trials = static_cast<std::size_t>(
      std::ranges::count(listed->records, TrialOutcome::complete, &TrialRecord::outcome));
  DatasetHasher hasher(info);
  out << "bench,trial,label,exploration,repetition,phase,t_s" << columns << '\n';
  for (std::size_t i = 0; i < listed->records.size(); ++i) {
    if (listed->records[i].outcome != TrialOutcome::complete) continue;
    const auto one =
        load_attempts(campaign, {.from = i, .most = 1, .stop_requested = stop_requested});
    if (!one) return pass(one.error());
    const classifier::Trial& trial = one->trials.front();
    const TrialRecord& record = one->records.front();
    hasher.add(trial, record);
    TrialRows rows{info, trial, record, begin_of_row(info, trial, record.spec),
                   PhaseAt(trial, record, info)};
    append_rows(rows, stream);
    if (!(out << rows.text))
      return fail({.code = Errc::io,
                   .where = "export",
                   .what = "table not written",
                   .hint = "Free some space on the disk"});
  }
  written.dataset_sha256 = hasher.finish().dataset_sha256;
  return written;
}

}  // namespace weft::daemon
