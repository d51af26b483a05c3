#include "daemon/analysis/tradeoff/measure_vibro.hpp"

#include <algorithm>
#include <array>

#include "daemon/analysis/tradeoff/vibro_paper.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;

constexpr const char* sound = "S";

std::string other_channels(const RecordingSet& set) {
  std::string out;
  std::size_t count = 0;
  for (const auto& c : set.recordings.front().channels) {
    if (c.name == sound) continue;
    out += c.name;
    ++count;
  }
  return count > 3 ? std::to_string(count) + " channels" : out;
}

bool has_sound(const RecordingSet& set) {
  return std::ranges::any_of(set.recordings.front().channels,
                             [](const auto& c) { return c.name == sound; });
}

std::array<vibro::Protocol, 2> protocols_of(const VibroTradeoffOptions& options) {
  return {vibro::Protocol::random, options.honest};
}

vibro::ProtocolOptions with(vibro::ProtocolOptions options, vibro::Protocol protocol,
                            double window_s) {
  options.protocol = protocol;
  options.window_s = window_s;
  return options;
}

// Properties shared by all learners with the same source, window, features and protocol.
struct Bed {
  std::string source;
  const std::vector<vibro::Recording>* recordings = nullptr;
  vibro::Family family{};
  vibro::ProtocolOptions protocol;
};

// Lists each recording once, even if several sources and features leave it out.
void note_too_short(const Bed& bed, const std::vector<vibro::TooShort>& recordings,
                    VibroTradeoff& out) {
  if (recordings.empty()) return;
  const vibro::ProtocolOptions& own = bed.protocol;
  auto at = std::ranges::find_if(out.too_short, [&](const VibroTooShort& one) {
    return one.protocol == own.protocol && one.window_s == own.window_s;
  });
  if (at == out.too_short.end()) {
    const std::size_t parts = own.protocol == vibro::Protocol::blocks ? own.blocks : 1;
    at = out.too_short.insert(at, {own.protocol, own.window_s, parts, {}});
  }
  for (const vibro::TooShort& one : recordings)
    if (std::ranges::find(at->recordings, one.file, &vibro::TooShort::file) == at->recordings.end())
      at->recordings.push_back(one);
}

Status measure_bed(const Bed& bed, const VibroTradeoffOptions& options,
                   const classifier::SecondsNow& now, VibroTradeoff& out) {
  const vibro::FeatureChoice choice{bed.family, options.combine};
  const auto windows = vibro::cut_and_extract(*bed.recordings, bed.protocol.window_s,
                                              vibro::places_of(bed.protocol), choice);
  if (!windows) return pass(windows.error());
  note_too_short(bed, windows->too_short, out);
  const auto splits = vibro::split_windows(*windows, bed.protocol);
  if (!splits) return pass(splits.error());
  const auto features_s =
      vibro_features_time(*bed.recordings, *windows, choice, options.timings, now);
  if (!features_s) return pass(features_s.error());
  vibro::Leak& leak =
      bed.protocol.protocol == vibro::Protocol::random ? out.random_leak : out.honest_leak;
  const vibro::Leak own = vibro::measure_leak(*windows, *splits);
  if (own.median > leak.median || (own.median == leak.median && own.largest > leak.largest))
    leak = own;
  const classifier::TrainOptions training =
      vibro::window_training(options.training, bed.protocol.protocol);
  for (const classifier::Learner learner : options.learners) {
    if (!classifier::is_available(learner)) continue;
    const classifier::Recipe recipe = vibro::window_recipe(learner, options.components);
    auto got = vibro::cross_validate(*windows, *splits, std::span(&recipe, 1), training, now);
    if (!got) return pass(got.error(), classifier::to_string(learner));
    name_left_out(*got, bed.protocol.protocol);
    out.points.push_back({learner, bed.family, bed.protocol.window_s, bed.source,
                          bed.protocol.protocol, std::move(*got), *features_s});
  }
  return {};
}

// Checks that a protocol's windows can be split, and that one of them can be cut.
Status check_windows(const RecordingSet& set, const vibro::ProtocolOptions& protocol) {
  const auto windows =
      vibro::lay_out(set.recordings, protocol.window_s, vibro::places_of(protocol));
  if (const auto splits = vibro::split_windows(windows, protocol); !splits)
    return pass(splits.error());
  const auto first = vibro::window_at(set.recordings[windows.recording.front()],
                                      windows.places.front().start_s, protocol.window_s);
  return first ? Status() : pass(first.error());
}

std::string point_name(const VibroPoint& p) {
  return std::string(classifier::to_string(p.learner)) + " " +
         std::string(vibro::to_string(p.family)) + " " + general(p.window_s) + " s " + p.source;
}

}  // namespace

Result<double> vibro_features_time(const std::vector<vibro::Recording>& recordings,
                                   const vibro::WindowSet& windows, vibro::FeatureChoice choice,
                                   std::size_t timings, const classifier::SecondsNow& now) {
  auto extractor = vibro::WindowExtractor::make(recordings.front().channels, choice);
  if (!extractor) return pass(extractor.error());
  std::vector<double> seconds;
  for (std::size_t i = 0; i <= timings; ++i) {
    const std::size_t row = i * 7919 % windows.places.size();  // a prime, to spread the rows over
                                                               // the set
    const auto window = vibro::window_at(recordings[windows.recording[row]],
                                         windows.places[row].start_s, windows.window_s);
    if (!window) return pass(window.error());
    const double begun = now();
    const auto row_features = extractor->features(*window);
    const double ended = now();
    if (!row_features) return pass(row_features.error());
    if (i > 0) seconds.push_back(ended - begun);  // the first one builds tables
  }
  return compute_median(std::move(seconds));
}

std::string protocol_name(vibro::Protocol protocol) {
  if (protocol == vibro::Protocol::random) return "random windows";
  return protocol == vibro::Protocol::blocks ? "contiguous parts" : "whole recordings";
}

std::vector<std::string> list_sources(const RecordingSet& set) {
  const std::string others = other_channels(set);
  if (!has_sound(set)) return {others};
  if (others.empty()) return {sound};
  return {sound, others, sound + others};
}

std::vector<vibro::Recording> of_source(const RecordingSet& set, const std::string& source) {
  const std::string others = other_channels(set);
  std::vector<vibro::Recording> out;
  for (const vibro::Recording& whole : set.recordings) {
    vibro::Recording own{whole.file, whole.label, whole.group, {}, {}};
    for (std::size_t c = 0; c < whole.channels.size(); ++c) {
      const bool is_sound = whole.channels[c].name == sound;
      if (is_sound ? source == others : source == sound) continue;
      own.channels.push_back(whole.channels[c]);
      own.samples.push_back(whole.samples[c]);
    }
    out.push_back(std::move(own));
  }
  return out;
}

Status check_vibro_tradeoff(const RecordingSet& set, const VibroTradeoffOptions& options) {
  if (options.timings < 5)
    return fail({.code = Errc::invalid_argument,
                 .where = "--timings",
                 .what = "too few timings for a median",
                 .expected = "at least 5",
                 .got = std::to_string(options.timings)});
  if (auto fine = check(set); !fine) return fine;
  for (const double window_s : options.windows_s)
    for (const vibro::Protocol protocol : protocols_of(options))
      if (auto ok = check_windows(set, with(options.protocol, protocol, window_s)); !ok)
        return pass(ok.error(),
                    general(window_s) + " s windows, " + std::string(vibro::to_string(protocol)));
  return {};
}

Result<VibroTradeoff> measure_vibro_tradeoff(const RecordingSet& set,
                                             const VibroTradeoffOptions& options,
                                             const classifier::SecondsNow& seconds_now,
                                             const TradeoffProgress& progress) {
  if (auto fine = check_vibro_tradeoff(set, options); !fine) return pass(fine.error());
  VibroTradeoff out;
  for (const classifier::Learner learner : options.learners)
    if (!classifier::is_available(learner))
      out.left_out.emplace_back(classifier::to_string(learner));
  out.honest = options.honest;
  const auto sources = options.sources.empty() ? list_sources(set) : options.sources;
  out.papers_recipe = is_papers_recipe(of_source(set, sources.back()),
                                       with(options.protocol, vibro::Protocol::random, 0.0),
                                       options.combine, options.components);
  const std::size_t steps = 2 * sources.size() * options.windows_s.size() * options.families.size();
  std::size_t step = 0;
  for (const std::string& source : sources) {
    const auto recordings = of_source(set, source);
    for (const double window_s : options.windows_s) {
      for (const vibro::Family family : options.families) {
        for (const vibro::Protocol protocol : protocols_of(options)) {
          const Bed bed{source, &recordings, family, with(options.protocol, protocol, window_s)};
          if (progress)
            progress(step++, steps,
                     source + ", " + general(window_s) + " s, " +
                         std::string(vibro::to_string(family)) + ", " +
                         std::string(vibro::to_string(protocol)));
          if (auto ok = measure_bed(bed, options, seconds_now, out); !ok) return pass(ok.error());
        }
      }
    }
  }
  return out;
}

TradeoffPoint vibro_tradeoff_point(BenchKind bench, std::string name,
                                   const vibro::CrossValidation& result, double features_s) {
  constexpr double least_s = 1e-9;  // the clock's step: a time must be positive to be drawn
  TradeoffPoint out;
  out.name = out.family = std::move(name);
  out.bench = bench;
  out.accuracy = result.f_score;
  out.ci95 = result.f_score_ci95;
  out.tested = result.confusion.total();
  out.features_s = features_s;
  out.vote_s = result.answer_s;
  out.answer_s = std::max(features_s + result.answer_s, least_s);
  out.timings_s = {out.answer_s};
  out.train_s = result.train_s;
  return out;
}

TradeoffSet vibro_tradeoff_set(const VibroTradeoff& tradeoff, const RecordingSet& set,
                               const std::string& file, vibro::Protocol protocol) {
  const bool random = protocol == vibro::Protocol::random;
  TradeoffSet out;
  out.dataset = file + (random ? ", random windows (the paper's protocol)"
                               : ", cross-validated by " + protocol_name(protocol));
  out.sha256 = recordings_sha256(set);
  out.bench = set.kind;
  const vibro::Leak& leak = random ? tradeoff.random_leak : tradeoff.honest_leak;
  out.facts = {{"recordings", static_cast<double>(set.recordings.size())},
               {"leak", leak.largest == 0.0 ? "test and training windows share no samples"
                                            : leak_sentence(leak)}};
  for (const std::string& name : tradeoff.left_out)
    out.left_out.emplace_back(name, "library missing in this build of Weft");
  for (const VibroTooShort& one : tradeoff.too_short)
    if (one.protocol == protocol)
      out.left_out.emplace_back("recordings for windows of " + general(one.window_s) + " s",
                                format_too_short(one.recordings, one.parts));
  for (const VibroPoint& p : tradeoff.points) {
    if (p.protocol != protocol) continue;
    TradeoffPoint point = vibro_tradeoff_point(set.kind, point_name(p), p.result, p.features_s);
    point.family = classifier::to_string(p.learner);
    point.contact_s = p.window_s;
    point.settings = {{"learner", std::string(classifier::to_string(p.learner))},
                      {"features", std::string(vibro::to_string(p.family))},
                      {"window_s", p.window_s},
                      {"source", p.source},
                      {"accuracy of windows", p.result.accuracy}};
    out.points.push_back(std::move(point));
  }
  return out;
}

}  // namespace weft::daemon
