!> Run time and error of the natural frequencies for every solver and every mesh of the scene. A precision study lists
!> these results as its entries, one for each solver on each mesh.
module solver_precision
   use failures, only: failure_t
   use frequency_study, only: find_exact
   use kinds, only: wp
   use motion_tasks, only: task_assembly, task_solver, task_t
   use precision_types, only: precision_t, solver_entry_t
   use scene_types, only: reference_exact, scene_t, solver_names
   use timed_tasks, only: measure_time
   implicit none (type, external)
   private
   public :: compare_solvers, rounding_start

contains

   !> Time every solver on every mesh, and compute the errors of its frequencies.
   subroutine compare_solvers(scene, study, error)
      !> Scene with &frequencies
      type(scene_t), intent(in) :: scene
      !> Study; the entries of the solvers are set
      type(precision_t), intent(inout) :: study
      !> Set if a mesh or the exact values fail; a solver that fails leaves an entry without errors and time
      type(failure_t), allocatable, intent(out) :: error

      ! number of modes if the scene gives none (0)
      integer, parameter :: default_count = 6
      type(failure_t), allocatable :: solver_error
      type(task_t) :: task
      real(wp), allocatable :: exact(:)
      integer :: i, j, count, entry_index, modes

      associate (requested => scene%frequencies)
         count = requested%count
         if (count == 0) count = default_count
         if (requested%reference == reference_exact) then
            call find_exact(scene, count, exact, error)
            if (allocated(error)) return
         end if
         allocate (study%solvers(size(requested%mesh_elements)*size(requested%solver)))
         entry_index = 0
         do j = 1, size(requested%solver)
            do i = 1, size(requested%mesh_elements)
               entry_index = entry_index + 1
               associate (entry => study%solvers(entry_index))
                  entry%solver = solver_names(requested%solver(j))
                  entry%elements = requested%mesh_elements(i)
                  entry%ratio = requested%mesh_ratios(i)
                  task%scene = scene
                  task%action = task_assembly
                  task%elements = entry%elements
                  task%ratio = entry%ratio
                  call task%run(error)
                  if (allocated(error)) return
                  task%action = task_solver
                  task%solver = requested%solver(j)
                  ! a mesh has two degrees of freedom, and so two modes, for each element
                  task%mode_count = min(count, 2*entry%elements)
                  call measure_time(task, scene%precision, entry%timing, solver_error)
                  if (allocated(solver_error) .or. .not. allocated(exact)) cycle
                  modes = min(size(task%lambda), size(exact))
                  if (modes == 0) cycle
                  entry%first_error = abs(task%lambda(1)/exact(1) - 1.0_wp)
                  entry%largest_error = maxval(abs(task%lambda(:modes)/exact(:modes) - 1.0_wp))
               end associate
            end do
         end do
      end associate
   end subroutine compare_solvers

   !> Number of elements beyond which the error of the first frequency no longer decreases, because rounding errors
   !> dominate; 0: the error decreases up to the finest mesh.
   pure integer function rounding_start(entries, solver, ratio) result(elements)
      type(solver_entry_t), intent(in) :: entries(:)
      !> Name of the solver
      character(*), intent(in) :: solver
      !> Ratio of the lengths of neighbouring elements
      real(wp), intent(in) :: ratio

      ! whether an entry belongs to the solver and the ratio and has a known error
      logical :: matches(size(entries))
      integer :: best

      matches = entries%solver == solver .and. abs(entries%ratio - ratio) <= 0.0_wp .and. entries%first_error >= 0.0_wp
      elements = 0
      best = minloc(entries%first_error, dim=1, mask=matches)
      if (best == 0) return
      if (any(matches .and. entries%elements > entries(best)%elements)) elements = entries(best)%elements
   end function rounding_start

end module solver_precision
