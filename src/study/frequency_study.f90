!> Tables of frequencies: each requested solver on each requested mesh, and the exact values.
module frequency_study
   use beam_model, only: beam_model_t, node_dofs
   use beam_section, only: section_t
   use constrained_modes, only: attach_supports
   use dsygv_solver, only: dsygv_modes
   use exact_frequencies, only: exact_lambda
   use failures, only: failure_t
   use frequency_types, only: frequency_table_t
   use kinds, only: wp
   use lanczos_solver, only: lanczos_modes
   use mesh_checks, only: mesh_check_t
   use mode_shapes, only: fix_mode_signs, mode_quality
   use natural_solver, only: natural_modes
   use piecewise_frequencies, only: piecewise_lambda, segments_of
   use scene_beam_model, only: model_of, section_of
   use scene_types, only: default_mode_count, reference_exact, scene_t, shape_section, solver_auto, solver_dsygv, &
      solver_lanczos, solver_names
   use section_shapes, only: is_uniform
   implicit none (type, external)
   private
   public :: frequency_table, find_exact, solve_modes, uses_lanczos

   !> Maximum number of elements for which both solvers take well under a millisecond. The dense solver, which cannot
   !> miss a mode, is then chosen.
   integer, parameter :: small_mesh = 20
   !> Maximum number of elements for which the dense solver is used if Lanczos iteration fails; it then takes about a
   !> second.
   integer, parameter :: max_dense_elements = 400

contains

   !> Fill the table of a scene. If a solver fails, its column is empty and has the error message.
   subroutine frequency_table(scene, table, error, found)
      type(scene_t), intent(in) :: scene
      type(frequency_table_t), intent(out) :: table
      !> Set if a mesh cannot be made, or if no solver finds a mode
      type(failure_t), allocatable, intent(out) :: error
      !> Mesh found for the response, which a table without a mesh of its own uses if this mesh has enough modes
      type(mesh_check_t), intent(in), optional :: found

      type(failure_t), allocatable :: solver_error
      type(beam_model_t) :: model
      ! numbers of elements, and ratios of neighbouring lengths
      integer, allocatable :: elements(:)
      real(wp), allocatable :: ratios(:)
      integer :: i, j, column, rows

      associate (group => scene%frequencies)
         allocate (elements, source=group%mesh_elements)
         allocate (ratios, source=group%mesh_ratios)
         if (present(found)) then
            if (group%has_mesh_of_response .and. 2*found%elements >= max(group%count, scene%output%mode_shapes, 1)) then
               elements = [found%elements]
               ratios = [found%ratio]
            end if
         end if
         allocate (table%columns(size(elements)*size(group%solver)))
         rows = 0
         column = 0
         do i = 1, size(elements)
            call model_of(scene, elements(i), ratios(i), model, error, moves=.false.)
            if (allocated(error)) return
            do j = 1, size(group%solver)
               column = column + 1
               associate (filled => table%columns(column))
                  filled%solver = trim(solver_names(group%solver(j)))
                  filled%elements = model%mesh%elements
                  ! 0 in the heading: the nodes are given
                  filled%ratio = merge(0.0_wp, ratios(i), allocated(scene%mesh%nodes))
                  call solve_modes(model, group%solver(j), merge(group%count, default_mode_count, group%count > 0), &
                     filled%lambda, solver_error)
                  if (allocated(solver_error)) then
                     filled%failure = solver_error%message
                     filled%lambda = spread(0.0_wp, 1, 0)
                  end if
                  rows = max(rows, size(filled%lambda))
               end associate
            end do
            if (i == 1 .and. scene%output%mode_shapes > 0) then
               call fill_shapes(model, group%solver(1), scene%output%mode_shapes, table, error)
               if (allocated(error)) return
            end if
         end do
         if (rows == 0 .and. allocated(solver_error)) then
            call move_alloc(solver_error, error)
         else if (group%reference == reference_exact) then
            call find_exact(scene, rows, table%exact, error)
         end if
      end associate
   end subroutine frequency_table

   !> Find the exact frequency parameters lambda_i, if they are known for the beam.
   subroutine find_exact(scene, count, lambda, error)
      type(scene_t), intent(in) :: scene
      !> Number of frequency parameters
      integer, intent(in) :: count
      !> lambda_i, ascending, [count]
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set if exact values are not known
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(section_t) :: section
      integer :: finest

      if (is_piecewise(scene)) then
         associate (group => scene%frequencies)
            ! the segments of the beam between stations, supports and masses are taken from the finest mesh
            finest = maxloc(group%mesh_elements, 1)
            call model_of(scene, group%mesh_elements(finest), group%mesh_ratios(finest), model, error, moves=.false.)
         end associate
         if (.not. allocated(error)) lambda = piecewise_lambda(count, segments_of(model))
      else
         section = section_of(scene%beam)
         call exact_lambda(count, section%taper, scene%tip_mass_ratio, lambda, error)
      end if
   end subroutine find_exact

   !> Whether the beam is anything other than a uniform or tapered cantilever with a tip mass. Its exact frequencies
   !> then follow from combined uniform segments.
   pure logical function is_piecewise(scene) result(answer)
      type(scene_t), intent(in) :: scene

      answer = scene%has_root_group .or. scene%has_masses .or. scene%has_supports
      if (scene%beam%shape == shape_section) answer = answer .or. .not. is_uniform(scene%beam%section)
   end function is_piecewise

   !> Compute the lowest frequency parameters lambda_i of a mesh, as many as the solver finds, and the mode shapes if
   !> `modes` is present.
   subroutine solve_modes(model, solver, count, lambda, error, modes)
      type(beam_model_t), intent(in) :: model
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      !> Number of requested modes
      integer, intent(in) :: count
      !> lambda_i, ascending
      real(wp), allocatable, intent(out) :: lambda(:)
      !> Set if the solver fails
      type(failure_t), allocatable, intent(out) :: error
      !> Shapes as columns, y and dy/dx of the nodes, unit modal mass, positive tip, [2 n, size(lambda)]
      real(wp), allocatable, intent(out), optional :: modes(:, :)

      real(wp), allocatable :: shapes(:, :)
      integer :: number

      ! each rigid support reduces the number of modes by one
      number = min(count, model%stiffness%order - sum(merge(1, 0, model%supports%stiffness <= 0.0_wp)))
      select case (solver)
      case (solver_dsygv)
         call dsygv_modes(model, number, lambda, error, modes)
      case (solver_lanczos)
         ! the Lanczos solver finds at most one mode for each element
         call lanczos_modes(model, min(count, model%mesh%elements), lambda, error, modes)
      case default
         if (solver == solver_auto .and. uses_lanczos(model%mesh%elements, number)) then
            call lanczos_modes(model, number, lambda, error, modes)
            if (.not. allocated(error) .or. model%mesh%elements > max_dense_elements) return
         end if
         if (size(model%supports) > 0) then
            ! all modes without the supports are constrained by one support after the other, which avoids cancellation
            ! in a stiffness matrix with supports
            call natural_modes(model, model%stiffness%order, lambda, error, shapes)
            if (allocated(error)) return
            call attach_supports(model%supports, lambda, shapes)
            lambda = lambda(:number)
            if (.not. present(modes)) return
            modes = shapes(:, :number)
            call fix_mode_signs(model%tip_dof, modes)
         else
            call natural_modes(model, number, lambda, error, modes)
         end if
      end select
   end subroutine solve_modes

   !> Whether `solver_auto` uses Lanczos iteration. Measured with 12 modes, Lanczos takes 0.1 ms for 30 elements and the
   !> dense solver 1 ms; for 400 elements they take 0.7 ms and 0.9 s.
   pure logical function uses_lanczos(elements, count) result(is_chosen)
      integer, intent(in) :: elements
      integer, intent(in) :: count

      is_chosen = elements > small_mesh .and. 2*count <= elements
   end function uses_lanczos

   !> Compute the mode shapes of one solver on one mesh at the nodes.
   subroutine fill_shapes(model, solver, count, table, error)
      type(beam_model_t), intent(in) :: model
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      !> Number of requested modes
      integer, intent(in) :: count
      !> The table; on return with nodes and shapes
      type(frequency_table_t), intent(inout) :: table
      !> Set if the solver fails
      type(failure_t), allocatable, intent(out) :: error

      real(wp), allocatable :: lambda(:), modes(:, :)
      integer :: dofs(2), i, n

      n = model%mesh%elements
      call solve_modes(model, solver, count, lambda, error, modes)
      if (allocated(error)) return
      table%quality = mode_quality(model, lambda, modes)
      allocate (table%node, source=model%mesh%position)
      allocate (table%shape(0:n, size(lambda)), table%shape_slope(0:n, size(lambda)), source=0.0_wp)
      do i = 0, n
         dofs = node_dofs(model, i)
         if (dofs(1) > 0) table%shape(i, :) = modes(dofs(1), :)
         if (dofs(2) > 0) table%shape_slope(i, :) = modes(dofs(2), :)
      end do
   end subroutine fill_shapes

end module frequency_study
