// SPDX-License-Identifier: MIT
// Ranks over MPI. All MPI calls go through one lock, so that MPI_THREAD_SERIALIZED suffices.
// Waiting ranks poll and sleep in between, so that they take no core from their neighbours. A
// thread of each rank reports every second that its process is alive: a rank that computes for
// minutes is; one that was stopped, or lost its network, is not.
#include <fcntl.h>
#include <fmt/format.h>
#include <mpi.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/ranks/ranks.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;
using std::chrono::milliseconds;

constexpr int kSizeTag = 1, kBytesTag = 2, kAliveTag = 3;
constexpr std::size_t kMostBytes = 1u << 30;  // per message, because MPI counts in int
constexpr auto kBeat = milliseconds(500);
constexpr double kSilentSeconds = 12;  // unless DARB_RANK_TIMEOUT is set
// The first rank watches all others, and they watch the first; where that falls silent, rank 1
// reports it.
constexpr double kLaterSeconds = 3;
// What fails on all ranks is reported by the first, which ends the others while they wait for that.
constexpr auto kFirstSpeaks = milliseconds(1500);
constexpr int kLauncherSeconds = 6, kMostFiles = 4096;
constexpr auto kLongestNap = std::chrono::microseconds(400);

double silent_seconds() {
    const char* const given = std::getenv("DARB_RANK_TIMEOUT");
    const double seconds = given ? std::atof(given) : 0;
    return seconds > 0 ? seconds : kSilentSeconds;
}

// mpirun waits a quarter of an hour to hear from a machine that cannot be reached. A process of its
// own tells it to end after kLauncherSeconds, and ends together with it if that comes first. It
// holds no file open, such as the lock of the run's folder. Open MPI 4.1 then ends with a
// segmentation fault of mpirun, as it does after a signal sent by hand.
void end_launcher_later() {
    const pid_t launcher = ::getppid();
    std::string name;
    std::getline(std::ifstream(fmt::format("/proc/{}/comm", launcher)), name);
    if (name != "mpirun" && name != "mpiexec" && name != "orterun" && name != "prterun") return;
    const int handle = static_cast<int>(::syscall(SYS_pidfd_open, launcher, 0));
    if (handle < 0 || ::fork() != 0) return;
    ::setsid();  // mpirun ends the processes in this one's group
    for (int file = 0; file < kMostFiles; ++file)
        if (file != handle) ::close(file);
    pollfd launcher_ends{handle, POLLIN, 0};
    if (::poll(&launcher_ends, 1, 1000 * kLauncherSeconds) == 0)
        ::syscall(SYS_pidfd_send_signal, handle, SIGTERM, nullptr, 0);
    std::_Exit(0);
}

class MpiRanks : public Ranks {
  public:
    MpiRanks();
    ~MpiRanks() override;

    int rank() const override { return rank_; }
    int count() const override { return count_; }
    Bytes exchange(int partner, std::span<const std::byte> bytes) override;
    std::vector<Bytes> gather(std::span<const std::byte> bytes) override;
    std::uint64_t sent_bytes() const override { return sent_bytes_; }
    double seconds() const override { return seconds_; }
    void finish() override;
    [[noreturn]] void fail(const std::string& what, int exit_code) override;

  private:
    using Requests = std::vector<MPI_Request>;

    std::string name_of(int rank) const {
        return fmt::format("rank {} of {} on {}", rank, count_, hosts_[std::size_t(rank)]);
    }
    void send(int to, std::span<const std::byte> bytes, int tag, Requests& requests);
    void receive(int from, std::span<std::byte> bytes, int tag, Requests& requests);
    void wait(Requests& requests);
    void wait_for_all();
    void say_nothing();
    void keep_alive();
    void beat(std::vector<MPI_Request>& sent, std::vector<Clock::time_point>& heard);
    void check_heard(const std::vector<Clock::time_point>& heard, Clock::time_point now);
    [[noreturn]] void end_all(const std::string& what, int exit_code);

    int rank_ = 0, count_ = 1;
    MPI_Comm work_ = MPI_COMM_NULL, alive_ = MPI_COMM_NULL;
    std::vector<std::string> hosts_;
    std::uint64_t sent_bytes_ = 0;
    double seconds_ = 0;
    int stderr_ = -1;  // where a rank that prints nothing else reports what went wrong
    std::mutex mpi_;
    std::atomic<bool> ends_{false};
    std::thread thread_;
};

MpiRanks::MpiRanks() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    if (provided < MPI_THREAD_SERIALIZED)
        throw Error(mpi_name(), "does not support calls from several threads",
                    "Use another build of MPI.");
    MPI_Comm_dup(MPI_COMM_WORLD, &work_);
    MPI_Comm_dup(MPI_COMM_WORLD, &alive_);
    std::vector<char> names(std::size_t(count_) * MPI_MAX_PROCESSOR_NAME, '\0');
    char own[MPI_MAX_PROCESSOR_NAME] = {};
    int length = 0;
    MPI_Get_processor_name(own, &length);
    MPI_Allgather(own, MPI_MAX_PROCESSOR_NAME, MPI_CHAR, names.data(), MPI_MAX_PROCESSOR_NAME,
                  MPI_CHAR, work_);
    for (int r = 0; r < count_; ++r)
        hosts_.emplace_back(&names[std::size_t(r) * MPI_MAX_PROCESSOR_NAME]);
    if (rank_ > 0) say_nothing();
    thread_ = std::thread([this] { keep_alive(); });
}

// A command that has nothing left to do, or whose rank failed alone, has already called finish or
// fail.
MpiRanks::~MpiRanks() {
    ends_ = true;
    if (thread_.joinable()) thread_.join();
}

void MpiRanks::say_nothing() {
    stderr_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere < 0) return;
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
    ::close(nowhere);
}

void MpiRanks::send(int to, std::span<const std::byte> bytes, int tag, Requests& requests) {
    sent_bytes_ += bytes.size();
    const std::lock_guard lock(mpi_);
    for (std::size_t at = 0; at < bytes.size(); at += kMostBytes)
        MPI_Isend(bytes.data() + at, static_cast<int>(std::min(kMostBytes, bytes.size() - at)),
                  MPI_BYTE, to, tag, work_, &requests.emplace_back());
}

void MpiRanks::receive(int from, std::span<std::byte> bytes, int tag, Requests& requests) {
    const std::lock_guard lock(mpi_);
    for (std::size_t at = 0; at < bytes.size(); at += kMostBytes)
        MPI_Irecv(bytes.data() + at, static_cast<int>(std::min(kMostBytes, bytes.size() - at)),
                  MPI_BYTE, from, tag, work_, &requests.emplace_back());
}

void MpiRanks::wait(Requests& requests) {
    auto nap = std::chrono::microseconds(10);
    for (;;) {
        int done = 0;
        {
            const std::lock_guard lock(mpi_);
            MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done,
                        MPI_STATUSES_IGNORE);
        }
        if (done != 0) break;
        std::this_thread::sleep_for(nap);
        nap = std::min(2 * nap, std::chrono::microseconds(kLongestNap));
    }
    requests.clear();
}

Bytes MpiRanks::exchange(int partner, std::span<const std::byte> bytes) {
    const auto start = Clock::now();
    std::uint64_t own = bytes.size(), its = 0;
    Requests requests;
    receive(partner, std::as_writable_bytes(std::span(&its, 1)), kSizeTag, requests);
    send(partner, bytes_of(own), kSizeTag, requests);
    wait(requests);
    Bytes got(its);
    receive(partner, got, kBytesTag, requests);
    send(partner, bytes, kBytesTag, requests);
    wait(requests);
    seconds_ += duration<double>(Clock::now() - start).count();
    return got;
}

std::vector<Bytes> MpiRanks::gather(std::span<const std::byte> bytes) {
    const auto start = Clock::now();
    const std::uint64_t own = bytes.size();
    std::vector<std::uint64_t> sizes(std::size_t(count_), own);
    std::vector<Bytes> all(static_cast<std::size_t>(count_));
    Requests requests;
    for (int r = 0; r < count_; ++r) {
        if (r == rank_) continue;
        receive(r, std::as_writable_bytes(std::span(&sizes[std::size_t(r)], 1)), kSizeTag,
                requests);
        send(r, bytes_of(own), kSizeTag, requests);
    }
    wait(requests);
    for (int r = 0; r < count_; ++r) {
        Bytes& its = all[std::size_t(r)];
        its.resize(sizes[std::size_t(r)]);
        if (r == rank_) {
            std::copy(bytes.begin(), bytes.end(), its.begin());
            continue;
        }
        receive(r, its, kBytesTag, requests);
        send(r, bytes, kBytesTag, requests);
    }
    wait(requests);
    seconds_ += duration<double>(Clock::now() - start).count();
    return all;
}

void MpiRanks::keep_alive() {
    std::vector<MPI_Request> sent(std::size_t(count_), MPI_REQUEST_NULL);
    std::vector<Clock::time_point> heard(std::size_t(count_), Clock::now());
    auto before = Clock::now();
    while (!ends_) {
        beat(sent, heard);
        const auto now = Clock::now();
        // This process itself was stopped, or the machine slept.
        if (now - before > 4 * kBeat) std::fill(heard.begin(), heard.end(), now);
        before = now;
        check_heard(heard, now);
        std::this_thread::sleep_for(kBeat);
    }
}

// One message to a rank at a time, so that a rank which takes none costs no memory.
void MpiRanks::beat(std::vector<MPI_Request>& sent, std::vector<Clock::time_point>& heard) {
    static const char alive = 1;
    const std::lock_guard lock(mpi_);
    for (int r = 0; r < count_; ++r) {
        if (r == rank_ || (rank_ > 0 && r > 0)) continue;
        int done = 0;
        MPI_Test(&sent[std::size_t(r)], &done, MPI_STATUS_IGNORE);
        if (done != 0) MPI_Isend(&alive, 1, MPI_CHAR, r, kAliveTag, alive_, &sent[std::size_t(r)]);
    }
    for (int come = 1; come != 0;) {
        MPI_Status status;
        MPI_Iprobe(MPI_ANY_SOURCE, kAliveTag, alive_, &come, &status);
        if (come == 0) break;
        char byte = 0;
        MPI_Recv(&byte, 1, MPI_CHAR, status.MPI_SOURCE, kAliveTag, alive_, MPI_STATUS_IGNORE);
        heard[std::size_t(status.MPI_SOURCE)] = Clock::now();
    }
}

void MpiRanks::check_heard(const std::vector<Clock::time_point>& heard, Clock::time_point now) {
    const int last = rank_ == 0 ? count_ : 1;
    const double limit = silent_seconds() + (rank_ > 1 ? kLaterSeconds : 0);
    for (int r = 0; r < last; ++r)
        if (r != rank_ && duration<double>(now - heard[std::size_t(r)]).count() > limit) {
            end_launcher_later();
            end_all(fmt::format("{} has said nothing for {:.0f} s: it was stopped, or cannot be "
                                "reached\n  All ranks end; go on from the last checkpoint with "
                                "--resume.",
                                name_of(r), limit),
                    2);
        }
}

void MpiRanks::end_all(const std::string& what, int exit_code) {
    if (stderr_ >= 0) ::dup2(stderr_, STDERR_FILENO);
    say("error: {}\n", what);
    // Without the lock, because a call of the other thread may hang inside it.
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    std::_Exit(exit_code);
}

void MpiRanks::fail(const std::string& what, int exit_code) {
    if (rank_ > 0) std::this_thread::sleep_for(kFirstSpeaks);
    end_all(fmt::format("{}: {}", name_of(rank_), what), exit_code);
}

void MpiRanks::wait_for_all() {
    gather({});
}

// The first rank may still be writing its files; the others wait for it, alive.
void MpiRanks::finish() {
    wait_for_all();
    ends_ = true;
    thread_.join();
    wait_for_all();
    MPI_Finalize();
}

}  // namespace

std::string mpi_name() {
    char version[MPI_MAX_LIBRARY_VERSION_STRING] = {};
    int length = 0;
    MPI_Get_library_version(version, &length);
    const std::string text(version, std::size_t(length));
    return text.substr(0, text.find_first_of(",\n"));
}

// MPI_Init takes a fifth of a second, so it is called only under an MPI launcher.
std::unique_ptr<Ranks> start_ranks() {
    if (launched_ranks() == 1) return std::make_unique<OneRank>();
    auto ranks = std::make_unique<MpiRanks>();
    if (ranks->count() == 1)
        throw Error("darb",
                    fmt::format("{} processes were started by another MPI than its own, {}",
                                launched_ranks(), mpi_name()),
                    "Start it with the mpirun that belongs to that one.");
    return ranks;
}

}  // namespace darb
