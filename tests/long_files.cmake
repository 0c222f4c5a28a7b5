# Files that no tag calls slow, but that take more than about eight seconds: scripts/test --quick leaves them out, too.
set(long_files cli_dof cli_dof_masks cli_frames cli_mistakes cli_program cli_resume cli_sequences cli_ssao contract dof
  dof_masks doubts fog io_exr_results linearize normals ssao ssao_brute_force ssao_half ssao_options unproject)
