// The verbs of the command line. Each Add... declares one; its callback leaves the exit code of the
// command in `exit_code`.
#pragma once

namespace CLI {
class App;
}

namespace covsplat {

/// run <recording>
void AddRunCommand(CLI::App& app, int& exit_code);

/// optimize <run folder>
void AddOptimizeCommand(CLI::App& app, int& exit_code);

/// demo
void AddDemoCommand(CLI::App& app, int& exit_code);

/// simulate <world>
void AddSimulateCommand(CLI::App& app, int& exit_code);

/// info <recording | map file | run folder>
void AddInfoCommand(CLI::App& app, int& exit_code);

/// eval traj | map
void AddEvalCommand(CLI::App& app, int& exit_code);

/// eval traj <estimate> <truth>
void AddEvalTrajectoryCommand(CLI::App& eval, int& exit_code);

/// eval map <mesh or cloud> <truth>
void AddEvalMapCommand(CLI::App& eval, int& exit_code);

/// mesh <run folder | map file>
void AddMeshCommand(CLI::App& app, int& exit_code);

/// render <run folder | map file>
void AddRenderCommand(CLI::App& app, int& exit_code);

/// export <run folder | map file>
void AddExportCommand(CLI::App& app, int& exit_code);

/// bench kitti | newer_college | oxford_spires
void AddBenchCommand(CLI::App& app, int& exit_code);

/// config dump | check | describe
void AddConfigCommand(CLI::App& app, int& exit_code);

}  // namespace covsplat
