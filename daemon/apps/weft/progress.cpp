#include "daemon/apps/weft/progress.hpp"

#include <algorithm>
#include <ostream>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

constexpr std::size_t bar_width = 24;
constexpr std::size_t most_lines = 20;

std::string trial_text(const TrialProgress& p) {
  return p.fabric + " " + p.exploration + " #" + std::to_string(p.repetition);
}

std::string count_text(const TrialProgress& p) {
  return std::to_string(p.done) + "/" + std::to_string(p.planned);
}

}  // namespace

std::string bar(std::size_t done, std::size_t planned, std::size_t width) {
  const std::size_t full = planned == 0 ? width : std::min(done, planned) * width / planned;
  return "[" + std::string(full, '#') + std::string(width - full, '.') + "]";
}

void ProgressPrinter::operator()(const TrialProgress& p) {
  const std::string left = p.done < p.planned ? "ETA " + duration(p.wall_left_s) : "done";
  if (terminal_) {
    rewrite(bar(p.done, p.planned, bar_width) + " " + count_text(p) + "  " + left + "  " +
            trial_text(p));
  } else {
    step(p, count_text(p) + " trials, " + duration(p.virtual_s) + " on the bench's clock, " +
                duration(p.wall_s) + " here, " + left);
  }
}

void ProgressPrinter::rewrite(const std::string& line) {
  const std::string wipe(last_width_ > line.size() ? last_width_ - line.size() : 0, ' ');
  *out_ << '\r' << line << wipe << std::flush;
  last_width_ = line.size();
}

void ProgressPrinter::step(const TrialProgress& p, const std::string& line) {
  if (p.outcome == recipes::Outcome::rejected)
    *out_ << "trial " << p.done + 1 << " (" << trial_text(p)
          << ") is taken again: " << (p.error ? to_string(*p.error) : "") << '\n';
  else if (p.outcome != recipes::Outcome::complete)
    *out_ << "trial " << p.done + (p.outcome == recipes::Outcome::failed ? 0 : 1) << " ("
          << trial_text(p) << ") did not complete\n";
  const std::size_t due = p.planned == 0 ? most_lines : p.done * most_lines / p.planned;
  if (due <= lines_) return;
  lines_ = due;
  *out_ << line << '\n' << std::flush;
}

void ProgressPrinter::finish() {
  if (terminal_ && last_width_ > 0) *out_ << '\n' << std::flush;
  last_width_ = 0;
}

}  // namespace weft::daemon::cli
