#include "classifier/vibro/protocol.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "classifier/base/random.hpp"
#include "classifier/vibro/level_features.hpp"
#include "protocols/base/hash.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier::vibro {
namespace {

constexpr NameTable<Protocol, 3> protocol_names = {
    {{Protocol::random, "random"}, {Protocol::blocks, "blocks"}, {Protocol::groups, "groups"}}};

using RowsOf = std::map<std::size_t, std::vector<std::size_t>>;

RowsOf by_recording(const WindowSet& windows) {
  RowsOf out;
  for (std::size_t r = 0; r < windows.recording.size(); ++r) out[windows.recording[r]].push_back(r);
  return out;
}

Split random_split(const WindowSet& windows, double test_share, RandomEngine& engine) {
  Split out;
  for (auto [recording, rows] : by_recording(windows)) {
    shuffle(rows, engine);
    const auto tests =
        static_cast<std::size_t>(test_share * static_cast<double>(rows.size()) + 0.5);
    for (std::size_t i = 0; i < rows.size(); ++i)
      (i < tests ? out.test : out.train).push_back(rows[i]);
  }
  std::sort(out.train.begin(), out.train.end());
  std::sort(out.test.begin(), out.test.end());
  return out;
}

template <class Tests>
Split split_by(const WindowSet& windows, const Tests& tests) {
  Split out;
  for (std::size_t r = 0; r < windows.places.size(); ++r)
    (tests(r) ? out.test : out.train).push_back(r);
  return out;
}

// Without training groups, all groups that do not test train.
Result<Split> split_by_groups(const std::vector<std::string>& groups,
                              std::vector<std::string> train,
                              const std::vector<std::string>& test) {
  if (train.empty())
    for (const std::string& group : std::set<std::string>(groups.begin(), groups.end()))
      if (std::find(test.begin(), test.end(), group) == test.end()) train.push_back(group);
  return grouped_split(groups, train, test);
}

Status check_side(const WindowSet& windows, const std::vector<std::size_t>& rows,
                  const std::string& side) {
  std::set<std::string> all(windows.matrix.labels.begin(), windows.matrix.labels.end());
  for (const TooShort& one : windows.too_short) all.insert(one.label);
  const auto own = labels_in(windows.matrix, rows);
  for (const std::string& label : all)
    if (!own.contains(label))
      return fail({.code = Errc::invalid_argument,
                   .where = label,
                   .what = "no " + side + " window",
                   .hint = "Use shorter windows, fewer blocks or more recordings"});
  return {};
}

// With whole recordings one may be missing: a group tests the labels that it has.
Status check_split(const WindowSet& windows, const Split& split, Protocol protocol) {
  if (auto ok = check_side(windows, split.train, "training"); !ok) return ok;
  if (protocol != Protocol::groups) return check_side(windows, split.test, "test");
  if (!split.test.empty()) return {};
  return fail({.code = Errc::invalid_argument,
               .what = "no test window",
               .hint = "Use shorter windows or other groups"});
}

}  // namespace

std::string_view to_string(Protocol protocol) {
  return name_in(protocol_names, protocol);
}

Result<Protocol> protocol_from(std::string_view text) {
  return value_from(protocol_names, text, "unknown protocol", "random, blocks or groups");
}

PlacesOf places_of(const ProtocolOptions& options) {
  return [options](const Recording& recording) {
    if (options.protocol != Protocol::random)
      return block_places(recording, options.window_s,
                          options.protocol == Protocol::blocks ? options.blocks : 1,
                          options.step_s);
    // Every recording of one seed gets different windows.
    const auto copied = options.drawn_as.find(recording.file);
    const std::uint64_t own =
        seed_of(copied == options.drawn_as.end() ? recording.file : copied->second);
    return random_places(recording, options.window_s, options.per_recording, options.seed ^ own);
  };
}

Result<std::vector<Split>> split_windows(const WindowSet& windows, const ProtocolOptions& options) {
  if (windows.places.empty())
    return fail({.code = Errc::invalid_argument,
                 .what = "recordings shorter than a window",
                 .hint = "Use shorter windows or fewer blocks"});
  std::vector<Split> out;
  if (options.protocol == Protocol::random) {
    RandomEngine engine(options.seed);
    for (std::size_t i = 0; i < options.repeats; ++i)
      out.push_back(random_split(windows, options.test_share, engine));
  } else if (options.protocol == Protocol::blocks) {
    if (options.blocks < 2)
      return fail({.code = Errc::invalid_argument,
                   .where = "--blocks",
                   .what = "too few blocks",
                   .expected = "at least 2",
                   .got = std::to_string(options.blocks)});
    for (std::size_t b = 0; b < options.blocks; ++b)
      out.push_back(split_by(windows, [&](std::size_t r) { return windows.places[r].block == b; }));
  } else if (options.train_groups.empty() && options.test_groups.empty()) {
    auto each = leave_one_group_out(windows.matrix.groups, windows.matrix.labels);
    if (!each) return pass(each.error());
    out = std::move(*each);
  } else {
    auto split = split_by_groups(windows.matrix.groups, options.train_groups, options.test_groups);
    if (!split) return pass(split.error());
    out.push_back(std::move(*split));
  }
  for (const Split& split : out)
    if (auto ok = check_split(windows, split, options.protocol); !ok) return pass(ok.error());
  return out;
}

namespace {

// The share of the samples of a window of `count` that are also in another one.
double shared(std::size_t first, std::size_t other, std::size_t count) {
  const std::size_t apart = first > other ? first - other : other - first;
  return apart < count ? static_cast<double>(count - apart) / static_cast<double>(count) : 0.0;
}

// Share of every test window of a split, by the samples of one channel. `share` keeps the larger
// value.
void add_shared(const WindowSet& windows, const Split& split, double rate_hz,
                std::span<double> share) {
  const std::size_t count = samples_in(windows.window_s, rate_hz);
  const auto first = [&](std::size_t r) {
    return first_sample(windows.places[r].start_s, rate_hz);
  };
  std::map<std::size_t, std::vector<std::size_t>>
      trained;  // recording -> first samples of its training windows
  for (const std::size_t r : split.train) trained[windows.recording[r]].push_back(first(r));
  for (std::size_t i = 0; i < split.test.size(); ++i) {
    const std::size_t own = first(split.test[i]);
    for (const std::size_t other : trained[windows.recording[split.test[i]]])
      share[i] = std::max(share[i], shared(own, other, count));
  }
}

}  // namespace

Leak measure_leak(const WindowSet& windows, const std::vector<Split>& splits) {
  std::vector<double> share;
  for (const Split& split : splits) {
    std::vector<double> own(split.test.size(), 0.0);
    for (const double rate_hz : windows.rates_hz) add_shared(windows, split, rate_hz, own);
    share.insert(share.end(), own.begin(), own.end());
  }
  Leak out;
  if (share.empty()) return out;
  out.largest = *std::ranges::max_element(share);
  out.windows = static_cast<double>(std::ranges::count_if(share, [](double s) { return s > 0; })) /
                static_cast<double>(share.size());
  out.median = MedianFinder().median(share);
  return out;
}

}  // namespace weft::classifier::vibro
