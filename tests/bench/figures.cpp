#include "tests/bench/figures.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

namespace weft::bench {
namespace {

std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

double ratio_of(const Figure& f) {
  return f.value / f.peer_value;  // infinite, null in JSON, without a peer
}

std::string text(double v) {
  char out[32];
  std::snprintf(out, sizeof out, "%.6g", v);
  return out;
}

nlohmann::json figure_json(const Figure& f) {
  nlohmann::json out{{"figure", f.figure}, {"value", f.value},           {"unit", f.unit},
                     {"peer", f.peer},     {"peer_value", f.peer_value}, {"ratio", ratio_of(f)},
                     {"note", f.note}};
  if (!f.limit) return out;
  out["limit"] = format_limit(f);
  out["missed"] = missed(f);
  return out;
}

void print_figure(const Figure& f) {
  std::printf("%-44s %12.6g %-10s", f.figure.c_str(), f.value, f.unit.c_str());
  if (!f.peer.empty())
    std::printf(" %-34s %12.6g %9.3g", f.peer.c_str(), f.peer_value, ratio_of(f));
  std::printf("%s\n", missed(f) ? "  MISSED" : "");
  if (!f.note.empty()) std::printf("    %s\n", f.note.c_str());
}

void print_misses(const std::vector<Figure>& figures) {
  const auto with_limit = std::count_if(figures.begin(), figures.end(),
                                        [](const Figure& f) { return f.limit.has_value(); });
  if (with_limit == 0) return;
  const auto misses = std::count_if(figures.begin(), figures.end(), missed);
  std::printf("%td of %td limits missed\n", misses, with_limit);
  for (const Figure& f : figures)
    if (missed(f))
      std::printf("  MISSED %s: %s %s, ratio %s; asked: %s\n", f.figure.c_str(),
                  text(f.value).c_str(), f.unit.c_str(), text(ratio_of(f)).c_str(),
                  format_limit(f).c_str());
}

}  // namespace

bool missed(const Figure& figure) {
  if (!figure.limit) return false;
  const double v = figure.limit->of == Limit::Of::ratio ? ratio_of(figure) : figure.value;
  const double bound = figure.limit->bound;
  return !(figure.limit->direction == Limit::Direction::at_most ? v <= bound : v >= bound);
}

std::string format_limit(const Figure& figure) {
  if (!figure.limit) return {};
  const bool most = figure.limit->direction == Limit::Direction::at_most;
  const std::string bound = (most ? "at most " : "at least ") + text(figure.limit->bound);
  if (figure.limit->of == Limit::Of::ratio) return "ratio " + bound;
  return figure.unit.empty() ? bound : bound + " " + figure.unit;
}

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double compute_median(std::size_t count, const std::function<void()>& work) {
  work();
  std::vector<double> s;
  for (std::size_t i = 0; i < count; ++i) s.push_back(seconds_of(work));
  return median(s);
}

nlohmann::json json_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::string out;
  for (int c = 0; pipe && (c = std::fgetc(pipe.get())) != EOF;) out.push_back(static_cast<char>(c));
  return nlohmann::json::parse(out, nullptr, false);
}

int report(const std::string& name, const std::vector<Figure>& figures) {
  const std::string cpu = cpu_model();
  const unsigned threads = std::thread::hardware_concurrency();
  std::printf("%s, %u threads\n", cpu.c_str(), threads);
  nlohmann::json list = nlohmann::json::array();
  std::printf("%-44s %12s %-10s %-34s %12s %9s\n", name.c_str(), "value", "unit", "peer or limit",
              "peer value", "ratio");
  for (const Figure& f : figures) {
    print_figure(f);
    list.push_back(figure_json(f));
  }
  print_misses(figures);
  const char* commit = std::getenv("WEFT_COMMIT");
  const nlohmann::json root{{"name", name},
                            {"figures", list},
                            {"machine", {{"cpu", cpu}, {"threads", threads}}},
                            {"commit", commit != nullptr ? commit : "unknown"}};
  std::filesystem::create_directories("out/bench");
  std::ofstream out("out/bench/" + name + ".json");
  out << root.dump(2) << '\n';
  out.flush();
  return out.good() && !figures.empty() ? 0 : 1;
}

}  // namespace weft::bench
