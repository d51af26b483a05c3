// A public set of slides over 20 materials, felt by the RoboSkin of an iCub.
#include <algorithm>
#include <array>
#include <set>

#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/dataset/trial_csv.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t triangle_taxels = 10;
constexpr std::int64_t step_ns = 20'000'000;
constexpr std::array<std::string_view, 4> named = {"sample", "label", "fold", "t"};

struct Columns {
  std::array<std::size_t, named.size()> of{};  ///< in the order of `named`
  std::vector<std::size_t> taxels;
};

Result<Columns> find_columns(const CsvReader& csv) {
  Columns out;
  std::vector<bool> taken(csv.header().size(), false);
  for (std::size_t k = 0; k < named.size(); ++k) {
    const auto column = find_column(csv, named[k]);
    if (!column) return csv.complaint("the column " + std::string(named[k]) + " is missing");
    out.of[k] = *column;
    taken[*column] = true;
  }
  if (auto done = find_channels(csv, "tx", taken, out.taxels); !done) return pass(done.error());
  if (out.taxels.size() % triangle_taxels != 0)
    return csv.complaint("taxels do not make whole triangles", "a multiple of 10",
                         std::to_string(out.taxels.size()));
  return out;
}

struct Slide {
  classifier::Trial trial;
  TrialRecord record;
};

// The step of the current line, which belongs to `slide`.
Status read_step(const CsvReader& csv, const Columns& columns, Slide& slide) {
  const auto& [sample, label, fold, t] = columns.of;
  classifier::Trial& trial = slide.trial;
  if (csv.fields()[label] != trial.label || csv.fields()[fold] != trial.group)
    return csv.complaint("another label or fold than the slide began with",
                         trial.label + ", " + trial.group,
                         csv.fields()[label] + ", " + csv.fields()[fold]);
  const std::string step = std::to_string(trial.samples());
  if (csv.fields()[t] != step)
    return csv.complaint("steps of a slide count up from 0", step, csv.fields()[t]);
  for (const std::size_t column : columns.taxels) {
    const auto value = csv.number(column);
    if (!value) return pass(value.error());
    trial.counts.push_back(*value);
  }
  slide.record.t_ns.push_back(static_cast<std::int64_t>(trial.samples()) * step_ns);
  trial.phase.push_back(Phase::motion);
  return {};
}

// See import.hpp. Ten values of frame t, triangle k, stand one behind the other, as filed in row
// group % steps and column group / steps, where group = triangles t + k.
void put_in_order_of_time(classifier::Trial& trial) {
  std::vector<double> frames(trial.counts.size());
  for (std::size_t j = 0; j < trial.samples(); ++j)
    for (std::size_t i = 0; i < trial.taxels / triangle_taxels; ++i) {
      const auto filed = trial.row(j).subspan(i * triangle_taxels, triangle_taxels);
      const std::size_t group = i * trial.samples() + j;
      std::ranges::copy(filed,
                        frames.begin() + static_cast<std::ptrdiff_t>(group * triangle_taxels));
    }
  trial.counts = std::move(frames);
}

// The slide that the current line begins.
Result<Slide> begun(const CsvReader& csv, const Columns& columns, std::set<std::string>& seen) {
  const auto& [sample, label, fold, t] = columns.of;
  const std::vector<std::string>& line = csv.fields();
  for (const std::size_t column : {sample, label, fold}) {
    if (line[column].empty()) return csv.complaint("a name is empty");
    if (!is_utf8(line[column])) return csv.complaint("a name is not UTF-8", "UTF-8 text");
  }
  if (!seen.insert(line[sample]).second)
    return csv.complaint("slide " + line[sample] + " comes back", "its steps together");
  Slide out;
  out.trial.file = line[sample];
  out.trial.label = line[label];
  out.trial.group = line[fold];
  out.trial.taxels = columns.taxels.size();
  return out;
}

// A step that is missing would move all values behind it to other taxels.
Status check_steps(const CsvReader& csv, const std::vector<Slide>& slides, Icub20Order order) {
  if (order == Icub20Order::filed || slides.empty()) return {};
  const classifier::Trial& last = slides.back().trial;
  const std::size_t steps = slides.front().trial.samples();
  if (last.samples() == steps) return {};
  return csv.complaint("slide " + last.file + " has another number of steps than the first",
                       std::to_string(steps), std::to_string(last.samples()));
}

Result<std::vector<Slide>> read_slides(CsvReader& csv, Icub20Order order) {
  const auto columns = find_columns(csv);
  if (!columns) return pass(columns.error());
  std::vector<Slide> out;
  std::set<std::string> seen;
  auto more = csv.next();
  for (; more && *more; more = csv.next()) {
    if (out.empty() || out.back().trial.file != csv.fields()[columns->of[0]]) {
      if (auto done = check_steps(csv, out, order); !done) return pass(done.error());
      auto slide = begun(csv, *columns, seen);
      if (!slide) return pass(slide.error());
      out.push_back(std::move(*slide));
    }
    if (auto done = read_step(csv, *columns, out.back()); !done) return pass(done.error());
  }
  if (!more) return pass(more.error());
  if (auto done = check_steps(csv, out, order); !done) return pass(done.error());
  if (out.empty()) return csv.complaint("a header but no slides");
  return out;
}

}  // namespace

Result<Dataset> import_icub20(const std::filesystem::path& path, Icub20Order order) {
  auto csv = CsvReader::open(path);
  if (!csv) return pass(csv.error());
  auto slides = read_slides(*csv, order);
  if (!slides) return pass(slides.error());
  Dataset dataset;
  dataset.info.kind = BenchKind::real;
  dataset.info.name = order == Icub20Order::time ? "icub20" : "icub20 as filed";
  dataset.info.source = "icub20";
  dataset.info.software_version = software_version();
  for (Slide& slide : *slides) {
    if (order == Icub20Order::time) put_in_order_of_time(slide.trial);
    if (auto done = append(dataset, std::move(slide.trial), std::move(slide.record)); !done)
      return pass(done.error());
  }
  dataset.info.taxel_rate_hz = common_rate_hz(dataset);
  return dataset;
}

}  // namespace weft::daemon
