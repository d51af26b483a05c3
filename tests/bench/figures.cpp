#include "tests/bench/figures.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
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

}  // namespace

double median(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median_of(std::size_t count, const std::function<void()>& work) {
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
  nlohmann::json list = nlohmann::json::array();
  std::printf("%-44s %12s %-10s %-34s %12s %9s\n", name.c_str(), "value", "unit", "peer or limit",
              "peer value", "ratio");
  for (const Figure& f : figures) {
    const double ratio = f.value / f.peer_value;  // infinite, null in JSON, without a peer
    std::printf("%-44s %12.6g %-10s", f.figure.c_str(), f.value, f.unit.c_str());
    if (!f.peer.empty()) std::printf(" %-34s %12.6g %9.3g", f.peer.c_str(), f.peer_value, ratio);
    std::printf("\n");
    if (!f.note.empty()) std::printf("    %s\n", f.note.c_str());
    list.push_back({{"figure", f.figure},
                    {"value", f.value},
                    {"unit", f.unit},
                    {"peer", f.peer},
                    {"peer_value", f.peer_value},
                    {"ratio", ratio},
                    {"note", f.note}});
  }
  const char* commit = std::getenv("WEFT_COMMIT");
  const nlohmann::json root{
      {"name", name},
      {"figures", list},
      {"machine", {{"cpu", cpu_model()}, {"threads", std::thread::hardware_concurrency()}}},
      {"commit", commit != nullptr ? commit : "unknown"}};
  std::filesystem::create_directories("out/bench");
  std::ofstream out("out/bench/" + name + ".json");
  out << root.dump(2) << '\n';
  out.flush();
  return out.good() && !figures.empty() ? 0 : 1;
}

}  // namespace weft::bench
