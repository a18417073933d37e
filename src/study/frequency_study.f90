!> Tables of frequencies: every solver on every mesh that a scene asks for, beside the exact values.
module frequency_study
   use auto_solver, only: auto_lambda, auto_modes
   use beam_model, only: beam_model_t
   use beam_section, only: kind_taper, kind_uniform, section_t
   use dsygv_solver, only: dsygv_lambda, dsygv_modes
   use exact_frequencies, only: exact_lambda
   use failures, only: failure_t
   use frequency_types, only: frequency_column_t, frequency_table_t
   use kinds, only: i8, wp
   use lanczos_solver, only: lanczos_lambda, lanczos_modes
   use mode_shapes, only: mode_quality, mode_quality_t
   use natural_solver, only: natural_lambda, natural_modes
   use scene_beam_model, only: model_of, section_of
   use scene_types, only: reference_exact, scene_t, solver_dsygv, solver_lanczos, solver_names, solver_natural
   implicit none (type, external)
   private
   public :: frequency_table, has_exact_frequencies, meshes_and_solvers, default_count

   !> Modes of a table whose scene gives no number.
   integer, parameter :: default_count = 12

contains

   !> Fill the table of a scene.
   subroutine frequency_table(scene, table, error)
      type(scene_t), intent(in) :: scene
      type(frequency_table_t), intent(out) :: table
      !> Set when a mesh cannot be made, or no solver gives anything
      type(failure_t), allocatable, intent(out) :: error

      type(failure_t), allocatable :: trouble
      type(beam_model_t) :: model
      type(section_t) :: section
      integer, allocatable :: elements(:), solvers(:)
      real(wp), allocatable :: ratios(:)
      integer :: i, j, column, rows

      call meshes_and_solvers(scene, elements, ratios, solvers)
      allocate (table%columns(size(elements)*size(solvers)))
      rows = 0
      column = 0
      do i = 1, size(elements)
         call model_of(scene, elements(i), ratios(i), model, error)
         if (allocated(error)) return
         do j = 1, size(solvers)
            column = column + 1
            call fill_column(model, solvers(j), wanted(scene%frequencies%count, model), ratios(i), &
               table%columns(column), trouble)
            rows = max(rows, size(table%columns(column)%lambda))
         end do
         if (i == 1 .and. scene%output%mode_shapes > 0) then
            call fill_shapes(model, solvers(1), scene%output%mode_shapes, table, error)
            if (allocated(error)) return
         end if
      end do
      if (rows == 0 .and. allocated(trouble)) then
         call move_alloc(trouble, error)
         return
      end if
      if (scene%frequencies%reference == reference_exact) then
         section = section_of(scene%beam)
         if (.not. has_exact_frequencies(section, scene%tip_mass_ratio)) return
         call exact_lambda(rows, section%taper, scene%tip_mass_ratio, table%exact, error)
      end if
   end subroutine frequency_table

   !> Is there a determinant for this beam?
   pure function has_exact_frequencies(section, tip_mass_ratio) result(has)
      type(section_t), intent(in) :: section
      !> mu
      real(wp), intent(in) :: tip_mass_ratio
      logical :: has

      has = section%kind == kind_uniform .or. section%kind == kind_taper
      ! a wedge gives way without limit under a point mass at its tip
      if (section%taper >= 1.0_wp .and. tip_mass_ratio > 0.0_wp) has = .false.
   end function has_exact_frequencies

   !> What the scene asks for, defaults filled in.
   pure subroutine meshes_and_solvers(scene, elements, ratios, solvers)
      type(scene_t), intent(in) :: scene
      !> Meshes, pairwise
      integer, allocatable, intent(out) :: elements(:)
      real(wp), allocatable, intent(out) :: ratios(:)
      !> Solvers
      integer, allocatable, intent(out) :: solvers(:)

      integer :: meshes

      associate (asked => scene%frequencies)
         meshes = 1
         if (allocated(asked%mesh_elements)) meshes = max(meshes, size(asked%mesh_elements))
         if (allocated(asked%mesh_ratios)) meshes = max(meshes, size(asked%mesh_ratios))
         allocate (elements(meshes), ratios(meshes))
         elements(:) = scene%mesh%elements
         ratios(:) = scene%mesh%ratio
         ! one value stands for all
         if (allocated(asked%mesh_elements)) then
            elements(:) = asked%mesh_elements(1)
            elements(:size(asked%mesh_elements)) = asked%mesh_elements
         end if
         if (allocated(asked%mesh_ratios)) then
            ratios(:) = asked%mesh_ratios(1)
            ratios(:size(asked%mesh_ratios)) = asked%mesh_ratios
         end if
         if (allocated(asked%solver)) then
            allocate (solvers, source=asked%solver)
         else
            allocate (solvers, source=[solver_natural])
         end if
      end associate
   end subroutine meshes_and_solvers

   !> Modes to compute on a mesh.
   pure function wanted(asked, model) result(modes)
      !> Number asked for, 0: not said
      integer, intent(in) :: asked
      type(beam_model_t), intent(in) :: model
      integer :: modes

      modes = asked
      if (asked == 0) modes = default_count
      modes = min(modes, model%stiffness%order)
   end function wanted

   !> One solver on one mesh. A solver that fails leaves an empty column with the reason.
   subroutine fill_column(model, solver, count, ratio, column, trouble)
      type(beam_model_t), intent(in) :: model
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      !> Modes
      integer, intent(in) :: count
      !> Ratio of the mesh, for the heading
      real(wp), intent(in) :: ratio
      type(frequency_column_t), intent(out) :: column
      !> Set when the solver fails
      type(failure_t), allocatable, intent(out) :: trouble

      integer(i8) :: start, finish, rate

      column%solver = trim(solver_names(solver))
      column%elements = model%mesh%elements
      column%ratio = ratio
      call system_clock(start, rate)
      select case (solver)
      case (solver_dsygv)
         call dsygv_lambda(model, count, column%lambda, trouble)
      case (solver_natural)
         call natural_lambda(model, count, column%lambda, trouble)
      case (solver_lanczos)
         call lanczos_lambda(model, min(count, model%mesh%elements), column%lambda, trouble)
      case default
         call auto_lambda(model, count, column%lambda, trouble)
      end select
      call system_clock(finish)
      column%seconds = real(finish - start, wp)/real(rate, wp)
      if (allocated(trouble)) then
         column%failure = trouble%message
         if (allocated(column%lambda)) deallocate (column%lambda)
         allocate (column%lambda(0))
      end if
   end subroutine fill_column

   !> Mode shapes of one solver on one mesh, on the nodes.
   subroutine fill_shapes(model, solver, count, table, error)
      type(beam_model_t), intent(in) :: model
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      !> Modes asked for
      integer, intent(in) :: count
      !> The table; nodes and shapes are filled
      type(frequency_table_t), intent(inout) :: table
      !> Set when the solver fails
      type(failure_t), allocatable, intent(out) :: error

      type(mode_quality_t) :: quality
      real(wp), allocatable :: lambda(:), modes(:, :)
      integer :: n

      n = model%mesh%elements
      select case (solver)
      case (solver_dsygv)
         call dsygv_modes(model, min(count, 2*n), lambda, modes, error)
      case (solver_natural)
         call natural_modes(model, min(count, 2*n), lambda, modes, error)
      case (solver_lanczos)
         call lanczos_modes(model, min(count, n), lambda, modes, error)
      case default
         call auto_modes(model, min(count, 2*n), lambda, modes, error)
      end select
      if (allocated(error)) return
      quality = mode_quality(model, lambda, modes)
      table%mass_orthogonality = quality%mass_orthogonality
      table%stiffness_orthogonality = quality%stiffness_orthogonality
      allocate (table%node, source=model%mesh%position)
      allocate (table%shape(0:n, size(lambda)), table%shape_slope(0:n, size(lambda)))
      table%shape(0, :) = 0.0_wp
      table%shape_slope(0, :) = 0.0_wp
      table%shape(1:, :) = modes(1::2, :)
      table%shape_slope(1:, :) = modes(2::2, :)
   end subroutine fill_shapes

end module frequency_study
