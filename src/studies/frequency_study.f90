!> Tables of frequencies: every solver on every mesh that a scene asks for, beside the exact values.
module frequency_study
   use beam_model, only: beam_model_t
   use beam_section, only: kind_taper, kind_uniform, section_t
   use dsygv_solver, only: dsygv_lambda, dsygv_modes
   use exact_frequencies, only: exact_lambda
   use failures, only: fail, failure_t, status_bad_input
   use frequency_types, only: frequency_column_t, frequency_table_t
   use kinds, only: i8, wp
   use scene_beam_model, only: model_of, section_of
   use scene_types, only: reference_exact, scene_t, solver_dsygv, solver_names
   implicit none (type, external)
   private
   public :: frequency_table, has_exact_frequencies

   !> Modes of a table whose scene gives no number.
   integer, parameter :: default_count = 12

contains

   !> Fill the table of a scene.
   subroutine frequency_table(scene, table, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The table
      type(frequency_table_t), intent(out) :: table
      !> Set when a mesh cannot be made or a solver fails
      type(failure_t), allocatable, intent(out) :: error

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
                             table%columns(column), error)
            if (allocated(error)) return
            rows = max(rows, size(table%columns(column)%lambda))
         end do
      end do
      if (scene%frequencies%reference == reference_exact) then
         section = section_of(scene%beam)
         if (.not. has_exact_frequencies(section, scene%tip_mass_ratio)) return
         call exact_lambda(rows, section%taper, scene%tip_mass_ratio, table%exact, error)
      end if
   end subroutine frequency_table

   !> Is there a determinant for this beam?
   pure function has_exact_frequencies(section, tip_mass_ratio) result(has)
      !> The section
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
      !> The scene
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
            allocate (solvers, source=[solver_dsygv])
         end if
      end associate
   end subroutine meshes_and_solvers

   !> Modes to compute on a mesh.
   pure function wanted(asked, model) result(modes)
      !> Number asked for, 0: not said
      integer, intent(in) :: asked
      !> The beam
      type(beam_model_t), intent(in) :: model
      integer :: modes

      modes = asked
      if (asked == 0) modes = default_count
      modes = min(modes, model%stiffness%order)
   end function wanted

   !> One solver on one mesh.
   subroutine fill_column(model, solver, count, ratio, column, error)
      !> The assembled beam
      type(beam_model_t), intent(in) :: model
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      !> Modes
      integer, intent(in) :: count
      !> Ratio of the mesh, for the heading
      real(wp), intent(in) :: ratio
      !> The column
      type(frequency_column_t), intent(out) :: column
      !> Set when the solver fails
      type(failure_t), allocatable, intent(out) :: error

      integer(i8) :: start, finish, rate

      column%solver = trim(solver_names(solver))
      column%elements = model%mesh%elements
      column%ratio = ratio
      call system_clock(start, rate)
      select case (solver)
      case (solver_dsygv)
         call dsygv_lambda(model, count, column%lambda, error)
      case default
         call fail(error, status_bad_input, 'solver '//column%solver//' is not there')
      end select
      call system_clock(finish)
      column%seconds = real(finish - start, wp)/real(rate, wp)
   end subroutine fill_column

end module frequency_study
