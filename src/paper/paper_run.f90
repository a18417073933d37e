!> Runs the program `impactbeam-paper`, which judges the statements of the paper (Irie, Yamada and Asano 1977), for one
!> scene with &statements.
module paper_run
   use failures, only: failure_t
   use memory_needs, only: add_modes, add_samples, memory_need_t
   use paper_cases, only: make_variants, variant_count, variant_t, sample_step
   use progress_line, only: start_progress, stop_progress
   use scene_types, only: scene_t
   use statements_file, only: refuse_foreign_text, write_statements
   use statements_study, only: judge_statements, study_t
   use statements_tables, only: print_statements
   use study_job, only: job_t
   use sweep_ranks, only: is_first_rank
   implicit none (type, external)
   private
   public :: memory_need_of_statements, run_statements

contains

   !> Estimate the memory that the scene needs. The runs are computed one after the other, each with its energy balance.
   subroutine memory_need_of_statements(scene, threads, need)
      type(scene_t), intent(in) :: scene
      !> Not used, because the runs are not computed in parallel
      integer, intent(in) :: threads
      type(memory_need_t), intent(out) :: need

      associate (unused => threads, statements => scene%statements)
         ! estimated: 55 numbers for each sample, of histories, energies and temporary arrays
         call add_samples(statements%duration/sample_step, 55, '&statements', 'give &statements a shorter duration', &
            need)
         ! the convergence study uses up to twice as many elements as the fine mesh
         call add_modes(2*statements%fine_elements, 1, 'give &statements fewer fine_elements', need)
      end associate
   end subroutine memory_need_of_statements

   !> Judge the statements, write the files and print the table.
   subroutine run_statements(scene, job, error)
      type(scene_t), intent(in) :: scene
      type(job_t), intent(in) :: job
      !> Set if a run fails or a file cannot be written
      type(failure_t), allocatable, intent(out) :: error

      type(study_t) :: study
      type(variant_t) :: variants(variant_count)

      if (.not. is_first_rank()) return
      call refuse_foreign_text(job%folder, scene, error)
      if (allocated(error)) return
      if (.not. job%quiet) call start_progress(job%label)
      call make_variants(scene%statements%elements, scene%statements%fine_elements, variants)
      call judge_statements(variants, scene%statements%duration, study, error)
      call stop_progress()
      if (allocated(error)) return
      call write_statements(job%folder, scene, study, error)
      if (allocated(error) .or. job%quiet) return
      call print_statements(job%unit, study)
   end subroutine run_statements

end module paper_run
