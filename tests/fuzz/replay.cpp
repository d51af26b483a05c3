// The fuzz targets without libFuzzer:  replay TARGET MUTATIONS FOLDER...
// Runs every file of the folders, then MUTATIONS inputs made from them, which are the same in every
// run. An input that ends the process is saved in `crash-input`.

#include <fcntl.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "tests/fuzz/target.hpp"

std::map<std::string, weft::fuzz::Target>& weft::fuzz::targets() {
  static std::map<std::string, Target> all;
  return all;
}

namespace {

using Bytes = std::vector<std::uint8_t>;

const Bytes* running = nullptr;  // for the signal handler, which has no argument for it

extern "C" void keep_input(int signal) {
  const int fd = ::open("crash-input", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const ssize_t written = running == nullptr ? 0 : ::write(fd, running->data(), running->size());
  ::close(written < 0 ? -1 : fd);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(weft::fuzz::Target target, const Bytes& input) {
  running = &input;
  target(input.data(), input.size());
}

/// splitmix64: the same numbers on every machine.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  std::size_t below(std::size_t bound) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<std::size_t>((z ^ (z >> 31)) % bound);
  }

 private:
  std::uint64_t state_;
};

void insert(Bytes& bytes, std::size_t at, std::string_view what) {
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), what.begin(), what.end());
}

void erase(Bytes& bytes, std::size_t from, std::size_t count) {
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(from);
  bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(std::min(count, bytes.size() - from)));
}

/// Texts that parsers often handle badly.
constexpr std::string_view awkward[]{"nan",
                                     "-inf",
                                     "1e999",
                                     "18446744073709551616",
                                     "18446744073709551615",
                                     "-1",
                                     "0",
                                     "\"",
                                     ",",
                                     "\n",
                                     "\r\n",
                                     "\\",
                                     " ",
                                     "1e-9",
                                     std::string_view("\0", 1),
                                     "\xff\xff\xff\xff"};

void mutate(Bytes& bytes, const Bytes& other, Numbers& numbers) {
  const std::size_t at = numbers.below(bytes.size() + 1);
  const std::size_t in = std::min(at, bytes.size() - 1);
  switch (bytes.empty() ? 2 : numbers.below(6)) {
    case 0:
      bytes[in] ^= static_cast<std::uint8_t>(1u << numbers.below(8));
      break;
    case 1:
      bytes[in] = static_cast<std::uint8_t>(numbers.below(256));
      break;
    case 2:
      insert(bytes, at, awkward[numbers.below(std::size(awkward))]);
      break;
    case 3:
      erase(bytes, in, 1 + numbers.below(16));
      break;
    case 4:
      bytes.resize(in);
      break;
    default:
      if (!other.empty())
        std::copy_n(other.begin(), std::min(other.size(), bytes.size()) / 2, bytes.begin());
  }
}

/// Adds every file of `folder`, in the order of their names.
void read_folder(const std::filesystem::path& folder, std::vector<Bytes>& out) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const auto& path : paths) {
    std::ifstream in(path, std::ios::binary);
    out.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return std::cerr << "replay TARGET MUTATIONS FOLDER...\n", 2;
  const auto target = weft::fuzz::targets().find(argv[1]);
  if (target == weft::fuzz::targets().end())
    return std::cerr << "replay: no target " << argv[1] << "\n", 2;
  std::vector<Bytes> corpus;
  for (int i = 3; i < argc; ++i) read_folder(argv[i], corpus);
  if (corpus.empty()) return std::cerr << "replay: no inputs in the folders\n", 2;
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) std::signal(signal, keep_input);
  for (const Bytes& input : corpus) run(target->second, input);
  Numbers numbers(1);
  const std::size_t mutations = std::strtoull(argv[2], nullptr, 10);
  for (std::size_t i = 0; i < mutations; ++i) {
    Bytes input = corpus[numbers.below(corpus.size())];
    for (std::size_t k = numbers.below(4) + 1; k > 0; --k)
      mutate(input, corpus[numbers.below(corpus.size())], numbers);
    run(target->second, input);
  }
  std::cout << corpus.size() << " inputs and " << mutations << " mutations\n";
}
