#include "daemon/storage/recordings/import_recordings.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <span>

#include "daemon/base/text/csv_table.hpp"
#include "daemon/storage/dataset/sample_times.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

using classifier::vibro::Channel;
using classifier::vibro::Recording;

constexpr double usual_hz = 20;                             // lower rates contain no vibration
constexpr std::size_t most_samples = std::size_t{1} << 24;  // per line

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> out;
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator(folder, gone))
    out.push_back(entry.path());
  std::ranges::sort(out);
  return out;
}

Status check_folder(const std::filesystem::path& folder) {
  if (std::filesystem::is_directory(folder)) return {};
  return fail({.code = Errc::not_found, .where = folder, .what = "no such folder"});
}

// The rate of a table, from its times.
struct TimedRate {
  double measured_hz = 0.0;
  double written_hz = 0.0;    // rounded to its significant digits
  double tolerance_hz = 0.0;  // largest error of `measured_hz`
};

// The longest interval between two samples, and its place.
struct LongestInterval {
  double s = 0.0;
  std::string where;
};

// Times have few decimals: the rate is significant to 0.01 Hz, and a slow one to four digits.
TimedRate timed_rate(double rate_hz, double tolerance_hz) {
  const double grain = rate_hz >= 1 ? 0.01 : std::pow(10.0, std::floor(std::log10(rate_hz)) - 3);
  return {rate_hz, std::round(rate_hz / grain) * grain, tolerance_hz};
}

// The rate of evenly spaced times that were rounded when written. Each end may be off by the
// largest rounding error in between, over the whole duration. No sample may be missing.
Result<TimedRate> even_rate(const std::vector<double>& times, const LongestInterval& longest) {
  const double duration_s = times.back() - times.front();
  const double step_s = duration_s / static_cast<double>(times.size() - 1);
  double worst_s = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i)
    worst_s =
        std::max(worst_s, std::abs(times[i] - times.front() - static_cast<double>(i) * step_s));
  if (worst_s > 0.5 * step_s || longest.s > 1.5 * step_s)
    return fail({.code = Errc::parse,
                 .where = longest.where,
                 .what = "samples not evenly spaced",
                 .expected = "an interval of " + std::to_string(step_s) + " s",
                 .got = std::to_string(longest.s) + " s",
                 .hint = "Cut the recording at missing samples; if none are missing, state the "
                         "rate of the sensor with --rate-hz"});
  return timed_rate(1 / step_s, 2 * worst_s / step_s / duration_s);
}

// True if a time is earlier than many samples before it. A few samples that were read late may be
// out of order.
bool runs_backwards(const std::vector<double>& times, double t_s) {
  constexpr std::size_t most_out_of_order = 8;
  return times.size() > most_out_of_order && t_s < times[times.size() - 1 - most_out_of_order];
}

// Gaps between consecutive samples, at the stated rate.
std::vector<classifier::vibro::Gap> find_pauses(const std::vector<double>& times, double rate_hz) {
  std::vector<std::int64_t> t_ns;
  for (const double s : times) t_ns.push_back(std::llround(1e9 * (s - times.front())));
  std::vector<classifier::vibro::Gap> out;
  for (const std::size_t i : samples_after_pause(t_ns)) {
    const double at_s = static_cast<double>(i) / rate_hz;
    out.push_back({at_s, at_s});
  }
  return out;
}

// Tables of one set with the same columns share one rate, unless their times show another. It is
// the first table's rate, or that of the table with the most precise times if one contradicts the
// first.
class TableRates {
 public:
  /// `first_channel`, `channels`: the channels of the recording that come from the table.
  void add(std::size_t recording, std::size_t first_channel, std::size_t channels,
           const TimedRate& own) {
    tables_.push_back({recording, first_channel, channels, own});
  }

  void settle(std::vector<Recording>& recordings) const {
    if (tables_.empty()) return;
    const TimedRate rate = common();
    for (const Table& table : tables_)
      for (Channel& c :
           std::span(recordings[table.recording].channels).subspan(table.first, table.channels))
        c.rate_hz = can_be_equal(table.own, rate) ? rate.written_hz : table.own.written_hz;
  }

 private:
  struct Table {
    std::size_t recording, first, channels;
    TimedRate own;
  };

  static bool can_be_equal(const TimedRate& a, const TimedRate& b) {
    return std::abs(a.measured_hz - b.measured_hz) <=
           a.tolerance_hz + b.tolerance_hz + classifier::vibro::clock_tolerance * a.measured_hz;
  }

  [[nodiscard]] TimedRate common() const {
    const TimedRate& first = tables_.front().own;
    const auto knows_better = [&first](const Table& table) {
      return can_be_equal(table.own, first) &&
             std::abs(first.written_hz - table.own.measured_hz) > table.own.tolerance_hz;
    };
    if (std::ranges::none_of(tables_, knows_better)) return first;
    return std::ranges::min_element(tables_, {}, [](const Table& t) { return t.own.tolerance_hz; })
        ->own;
  }

  std::vector<Table> tables_;
};

// Evenly sampled columns beside a column of times; TableRates sets the rate of the channels later.
Result<TimedRate> read_table(const std::filesystem::path& path, const std::string& time,
                             double stated_hz, Recording& out, std::vector<Warning>& warnings) {
  auto csv = CsvTable::open(path);
  if (!csv) return pass(csv.error());
  const auto time_column = csv->take_column(time);
  if (!time_column) return pass(time_column.error());
  const std::vector<std::size_t> columns = csv->take_rest();
  for (const std::size_t c : columns) out.channels.push_back({csv->header()[c], 0.0, "1"});
  if (out.channels.empty()) return csv->complaint("table without channels");
  out.samples.resize(columns.size());
  std::vector<double> times;
  LongestInterval longest;
  RepeatedSamples repeated;
  auto more = csv->next();
  for (; more && *more; more = csv->next()) {
    const auto t_s = csv->time(*time_column);
    if (!t_s) return pass(t_s.error());
    if (runs_backwards(times, *t_s)) return csv->complaint("time decreases");
    bool is_repeated = !times.empty() && times.back() == *t_s;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const auto value = csv->number(columns[k]);
      if (!value) return pass(value.error());
      is_repeated = is_repeated && out.samples[k].back() == *value;
      out.samples[k].push_back(*value);
    }
    repeated.add(*csv, is_repeated);
    const double since_s = times.empty() ? 0.0 : *t_s - times.back();
    if (since_s > longest.s) longest = {since_s, csv->where()};
    times.push_back(*t_s);
  }
  if (!more) return pass(more.error());
  if (auto done = repeated.check(stated_hz > 0, warnings); !done) return pass(done.error());
  if (stated_hz > 0) {
    out.gaps = find_pauses(times, stated_hz);
    return TimedRate{stated_hz, stated_hz, 0.0};
  }
  if (times.size() < 2 || !(times.back() > times.front()))
    return csv->complaint("sampling rate cannot be computed from the times");
  return even_rate(times, longest);
}

Status read_sound(const std::filesystem::path& path, Recording& out) {
  auto sound = read_sound_file(path);
  if (!sound) return pass(sound.error());
  const bool several = sound->channels.size() > 1;
  for (std::size_t c = 0; c < sound->channels.size(); ++c)
    out.channels.push_back({several ? "S" + std::to_string(c + 1) : "S", sound->rate_hz, "1"});
  out.samples = std::move(sound->channels);
  return {};
}

// Lines of numbers, of any length, without a header.
Result<std::vector<std::vector<double>>> read_lines(const std::filesystem::path& path) {
  auto csv = CsvTable::open(path, {.heading = CsvRules::Heading::never,
                                   .equal_lines = false,
                                   .most_columns = most_samples,
                                   .most_line_bytes = CsvTable::max_file_bytes});
  if (!csv) return pass(csv.error());
  std::vector<std::vector<double>> out;
  auto more = csv->next();
  for (; more && *more; more = csv->next()) {
    out.emplace_back();
    if (auto done = csv->append_numbers(out.back()); !done) return pass(done.error());
  }
  if (!more) return pass(more.error());
  return out;
}

std::string texture_name(std::size_t number) {
  return std::string("texture") + (number < 10 ? "0" : "") + std::to_string(number);
}

// One channel of every texture; empty for a texture without a sound track.
Result<std::vector<std::vector<double>>> vibtac_channel(const std::filesystem::path& folder,
                                                        const std::string& name, Channel& channel) {
  constexpr std::size_t textures = 12;
  if (name != "S") {
    channel = {name, 200.0, "count"};
    auto lines = read_lines(folder / (name + ".csv"));
    if (lines && lines->size() != textures)
      return fail({.code = Errc::parse,
                   .where = folder / (name + ".csv"),
                   .what = "wrong number of textures",
                   .expected = std::to_string(textures),
                   .got = std::to_string(lines->size())});
    return lines;
  }
  std::vector<std::vector<double>> out(textures);
  for (std::size_t t = 0; t < textures; ++t) {
    const auto path = folder / ("Texture" + std::to_string(t + 1) + ".wav");
    if (!std::filesystem::exists(path)) continue;
    auto sound = read_sound_file(path);
    if (!sound) return pass(sound.error());
    if (channel.rate_hz > 0 && channel.rate_hz != sound->rate_hz)
      return fail({.code = Errc::parse,
                   .where = path,
                   .what = "sampling rate differs from the tracks before",
                   .expected = std::to_string(channel.rate_hz) + " Hz",
                   .got = std::to_string(sound->rate_hz) + " Hz"});
    channel = {"S", sound->rate_hz, "1"};
    out[t] = std::move(sound->channels.front());
  }
  return out;
}

Result<RecordingSet> finished(RecordingSet set, const std::filesystem::path& from) {
  if (auto fine = check(set); !fine) return pass(fine.error(), from.string());
  return set;
}

}  // namespace

namespace {

// One file of a manifest. The rate of a table is computed from its times.
struct OneFile {
  Recording recording;
  std::optional<TimedRate> rate = {};  // only for a table
};

Result<OneFile> read_file(const ManifestEntry& entry, double stated_hz,
                          std::vector<Warning>& warnings) {
  const std::string& name = entry.recording.empty() ? entry.file : entry.recording;
  OneFile out{{name, entry.label, entry.group, {}, {}, {}, entry.group_values}};
  if (!is_csv_name(entry.path)) {
    if (const Status done = read_sound(entry.path, out.recording); !done)
      return pass(done.error(), entry.where);
    return out;
  }
  const auto timed = read_table(entry.path, "t_s", stated_hz, out.recording, warnings);
  if (!timed) return pass(timed.error(), entry.where);
  out.rate = *timed;
  return out;
}

tl::unexpected<Error> not_of_one(const ManifestEntry& entry, const std::string& what,
                                 const std::string& expected, const std::string& got) {
  return fail(
      {.code = Errc::invalid_argument,
       .where = entry.where,
       .what = what,
       .expected = expected,
       .got = got,
       .hint = "Use the same name under `recording` only for files recorded at the same time"});
}

// Adds the channels of another file to a recording; both start at the same instant.
Status join(const ManifestEntry& entry, Recording file, Recording& whole) {
  if (file.label != whole.label)
    return not_of_one(entry, "label differs from the other file of the recording", whole.label,
                      file.label);
  if (file.group != whole.group)
    return not_of_one(entry, "group differs from the other file of the recording", whole.group,
                      file.group);
  if (file.group_values != whole.group_values)
    return not_of_one(entry, "group columns differ from the other file of the recording",
                      joined(whole.group_values), joined(file.group_values));
  if (!file.gaps.empty() || !whole.gaps.empty())
    return not_of_one(entry, "samples missing in a recording of several files",
                      "tables without gaps", entry.file);
  for (const Channel& channel : file.channels)
    if (std::ranges::find(whole.channels, channel.name, &Channel::name) != whole.channels.end())
      return not_of_one(entry, "channel name repeated in the other file of the recording",
                        "another name", channel.name);
  std::ranges::move(file.channels, std::back_inserter(whole.channels));
  std::ranges::move(file.samples, std::back_inserter(whole.samples));
  return {};
}

// Index of the recording that a file belongs to; the next index for a new recording.
std::size_t place_of(const ManifestEntry& entry, std::map<std::string, std::size_t>& places,
                     std::size_t recordings) {
  return entry.recording.empty() ? recordings
                                 : places.emplace(entry.recording, recordings).first->second;
}

}  // namespace

Result<RecordingSet> import_recordings(const std::filesystem::path& path, double rate_hz,
                                       std::optional<BenchKind> bench) {
  const auto manifest = read_manifest(path, ManifestKind::recordings, bench);
  if (!manifest) return pass(manifest.error());
  RecordingSet set{path.stem().string(), "recordings", manifest->bench, {}};
  set.group_columns = manifest->group_columns;
  std::map<std::string, TableRates> rates;  // by the name of the first channel
  std::map<std::string, std::size_t> places;
  for (const ManifestEntry& entry : manifest->entries) {
    auto file = read_file(entry, rate_hz, set.warnings);
    if (!file) return pass(file.error());
    const std::size_t place = place_of(entry, places, set.recordings.size());
    const bool is_new = place == set.recordings.size();
    if (file->rate)
      rates[file->recording.channels.front().name].add(
          place, is_new ? 0 : set.recordings[place].channels.size(),
          file->recording.channels.size(), *file->rate);
    if (is_new) {
      set.recordings.push_back(std::move(file->recording));
    } else if (auto done = join(entry, std::move(file->recording), set.recordings[place]); !done) {
      return pass(done.error());
    }
  }
  for (const auto& [column, tables] : rates) tables.settle(set.recordings);
  if (rate_hz == 0)
    warn_of_slow_rate(
        std::ranges::min(set.recordings.front().channels, {}, &Channel::rate_hz).rate_hz, usual_hz,
        set.warnings);
  return finished(std::move(set), path);
}

Result<RecordingSet> import_vibtac12(const std::filesystem::path& folder,
                                     const std::vector<std::string>& channels) {
  if (auto ok = check_folder(folder); !ok) return pass(ok.error());
  RecordingSet set{"vibtac12", "vibtac12", BenchKind::real, {}};
  std::vector<Channel> own(channels.size());
  std::vector<std::vector<std::vector<double>>> samples;  // [channel][texture]
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c] != "S" && channels[c] != "X" && channels[c] != "Y" && channels[c] != "Z")
      return fail({.code = Errc::invalid_argument,
                   .where = "vibtac12",
                   .what = "unknown channel",
                   .expected = "S, X, Y or Z",
                   .got = channels[c]});
    auto of_texture = vibtac_channel(folder, channels[c], own[c]);
    if (!of_texture) return pass(of_texture.error());
    samples.push_back(std::move(*of_texture));
  }
  for (std::size_t t = 0; !samples.empty() && t < samples.front().size(); ++t) {
    if (std::ranges::any_of(samples, [&](const auto& s) { return s[t].empty(); })) continue;
    Recording r{texture_name(t + 1), texture_name(t + 1), "1", own, {}};
    for (auto& of_channel : samples) r.samples.push_back(std::move(of_channel[t]));
    set.recordings.push_back(std::move(r));
  }
  return finished(std::move(set), folder);
}

Result<RecordingSet> import_lmt_sound(const std::filesystem::path& folder) {
  if (auto ok = check_folder(folder); !ok) return pass(ok.error());
  static const std::regex pattern(R"((.+)_([0-9]+)\.wav)");
  RecordingSet set{"lmt_sound", "lmt_sound", BenchKind::real, {}};
  for (const auto& material : files_in(folder)) {
    if (!std::filesystem::is_directory(material)) continue;
    for (const auto& path : files_in(material)) {
      std::smatch parts;
      const std::string name = path.filename().string();
      if (!std::regex_match(name, parts, pattern))
        return fail({.code = Errc::parse,
                     .where = path,
                     .what = "file name does not follow this layout",
                     .expected = "<Material>_<number>.wav",
                     .got = name});
      Recording own{name, material.filename().string(), parts[2], {}, {}};
      if (auto done = read_sound(path, own); !done) return pass(done.error());
      set.recordings.push_back(std::move(own));
    }
  }
  return finished(std::move(set), folder);
}

Result<RecordingSet> import_hapmat(const std::filesystem::path& folder, double rate_hz) {
  if (auto ok = check_folder(folder); !ok) return pass(ok.error());
  RecordingSet set{"hapmat", "hapmat", BenchKind::real, {}};
  TableRates rates;
  for (const auto& path : files_in(folder)) {
    if (!is_csv_name(path)) continue;
    Recording own{path.filename().string(), path.stem().string(), "1", {}, {}};
    const auto timed = read_table(path, "time", rate_hz, own, set.warnings);
    if (!timed) return pass(timed.error());
    rates.add(set.recordings.size(), 0, own.channels.size(), *timed);
    set.recordings.push_back(std::move(own));
  }
  rates.settle(set.recordings);
  if (rate_hz == 0 && !set.recordings.empty())
    warn_of_slow_rate(set.recordings.front().channels.front().rate_hz, usual_hz, set.warnings);
  return finished(std::move(set), folder);
}

}  // namespace weft::daemon
