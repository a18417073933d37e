!> The modes of a large mesh that a run is made in: some of the lowest, and what the others do where something acts on
!> the beam (docs/theory.md, section 13).
module few_modes
   use applied_loads, only: applied_loads_t, gather_loads, has_loads
   use beam_model, only: beam_model_t, hold_supports, is_mechanism
   use failures, only: failure_t
   use free_modes, only: describe_modes, find_free_modes, free_modes_t
   use held_coordinates, only: displace, displace_transposed, held_beam_t, make_held_beam, strain_of_shape
   use kinds, only: wp
   use lanczos_solver, only: lambda_of, lanczos_vectors
   use mode_shapes, only: fix_mode_signs
   use pinned_coordinates, only: rigid_rotation
   use residual_modes, only: add_residual_modes
   use run_settings, only: impulse_nodal, run_settings_t
   use skyline_matrix, only: factorise, skyline_t, solve_factorised
   use stop_laws, only: is_rigid
   use stop_surfaces, only: stops_of
   implicit none (type, external)
   private
   public :: takes_few_modes, wants_few_modes, find_few_modes, find_modes_of_run, first_count, most_count

   !> Up to this many elements all modes are found at once, in a tenth of a second.
   integer, parameter :: largest_dense = 100
   !> Modes to begin with, and beyond which no more are tried.
   integer, parameter :: first_count = 32
   integer, parameter :: most_count = 256
   !> Modes of runs that cannot be compared with others.
   integer, parameter :: usual_count = 64

contains

   !> Is the mesh of a run so large that it takes a part of its modes?
   pure function wants_few_modes(model, settings) result(answer)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      logical :: answer

      answer = takes_few_modes(model%mesh%elements, settings)
   end function wants_few_modes

   !> The same of a mesh that is not made yet.
   pure function takes_few_modes(elements, settings) result(answer)
      integer, intent(in) :: elements
      type(run_settings_t), intent(in) :: settings
      logical :: answer

      answer = elements > largest_dense .and. .not. settings%response%keep_all_modes .and. &
         settings%stop%impulse /= impulse_nodal
   end function takes_few_modes

   !> The modes of a run that is not compared with another: all, or of a large mesh the usual number.
   subroutine find_modes_of_run(model, settings, modes, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(free_modes_t), intent(out) :: modes
      !> Set when they cannot be found
      type(failure_t), allocatable, intent(out) :: error

      integer :: count

      if (wants_few_modes(model, settings)) then
         count = usual_count
         if (settings%response%mode_count > 0) count = settings%response%mode_count
         call find_few_modes(model, settings, count, modes, error)
      else
         call find_free_modes(model, modes, error)
      end if
   end subroutine find_modes_of_run

   !> The lowest modes, and those of what the others do. All, where so few cannot be had and all still can.
   subroutine find_few_modes(model, settings, count, modes, error)
      type(beam_model_t), intent(in) :: model
      !> Stops and loads
      type(run_settings_t), intent(in) :: settings
      !> Number of the lowest modes
      integer, intent(in) :: count
      type(free_modes_t), intent(out) :: modes
      !> Set when they cannot be found
      type(failure_t), allocatable, intent(out) :: error

      !> Solved at once in some minutes
      integer, parameter :: last_resort = 2048
      type(held_beam_t) :: beam
      real(wp), allocatable :: deflection(:, :), shapes(:, :), vectors(:, :)
      integer :: lowest, rigid

      call make_held_beam(model, beam)
      rigid = merge(1, 0, is_mechanism(model))
      lowest = max(count, settings%start%mode)
      if (lowest <= model%mesh%elements/2) then
         call lanczos_vectors(model, beam, lowest - rigid, vectors, deflection, error)
      end if
      if (.not. allocated(vectors) .or. allocated(error)) then
         if (allocated(error) .and. model%mesh%elements > last_resort) then
            error%message = error%message//'; take fewer elements, a mesh ratio nearer to 1, or fewer modes (modes)'
            return
         end if
         if (allocated(error)) deallocate (error)
         call find_free_modes(model, modes, error)
         return
      end if
      call gather_shapes(model, settings, beam, shapes, error)
      if (.not. allocated(error)) call add_residual_modes(beam, shapes, vectors, deflection, error)
      if (.not. allocated(error)) call fill_modes(model, beam, vectors, deflection, modes)
   end subroutine find_few_modes

   !> Static shapes of forces at stops and of loads; what an impulse on a rigid stop sets in motion.
   subroutine gather_shapes(model, settings, beam, shapes, error)
      type(beam_model_t), intent(in) :: model
      type(run_settings_t), intent(in) :: settings
      type(held_beam_t), intent(in) :: beam
      !> In the coordinates of the beam, [order, shapes]
      real(wp), allocatable, intent(out) :: shapes(:, :)
      !> Set when the mass matrix cannot be factorised
      type(failure_t), allocatable, intent(out) :: error

      type(applied_loads_t) :: loads
      type(beam_model_t) :: held
      type(skyline_t) :: factors
      real(wp), allocatable :: forces(:, :), shape(:)
      logical, allocatable :: is_struck(:)
      integer :: j, stops

      stops = 0
      if (settings%has_stop) stops = size(model%stop_dofs)
      allocate (is_struck(stops), source=.false.)
      if (stops > 0) is_struck = is_rigid(stops_of(settings)) .and. .not. model%has_massless_node
      if (has_loads(settings)) call gather_loads(model, settings, loads)
      allocate (forces(beam%dofs, stops + loads%count), source=0.0_wp)
      do j = 1, stops
         forces(model%stop_dofs(j), j) = 1.0_wp
      end do
      if (loads%count > 0) forces(:, stops + 1:) = loads%vector
      forces(beam%held, :) = 0.0_wp
      allocate (shapes(beam%order, size(forces, 2) + count(is_struck)))
      do j = 1, size(forces, 2)
         call displace_transposed(beam, forces(:, j), shapes(:, j))
      end do
      if (.not. any(is_struck)) return
      held = hold_supports(model)
      factors = held%mass
      call factorise(factors, error)
      if (allocated(error)) return
      do j = 1, stops
         if (.not. is_struck(j)) cycle
         shape = forces(:, j)
         call solve_factorised(factors, shape)
         shapes(:, size(forces, 2) + count(is_struck(:j))) = strain_of_shape(beam, shape)
      end do
   end subroutine gather_shapes

   !> Shapes of the nodes, a rotation about the root first where nothing holds it.
   subroutine fill_modes(model, beam, vectors, deflection, modes)
      type(beam_model_t), intent(in) :: model
      type(held_beam_t), intent(in) :: beam
      !> [order, modes]
      real(wp), intent(in) :: vectors(:, :)
      !> B times the vectors, [rows, modes]
      real(wp), intent(in) :: deflection(:, :)
      type(free_modes_t), intent(out) :: modes

      real(wp) :: direction(beam%rows), motion(beam%dofs)
      integer :: j, rigid

      rigid = merge(1, 0, is_mechanism(model))
      allocate (modes%lambda(rigid + size(vectors, 2)), source=0.0_wp)
      allocate (modes%mode(beam%dofs, rigid + size(vectors, 2)))
      modes%lambda(rigid + 1:) = lambda_of(vectors, deflection)
      if (rigid > 0) then
         call rigid_rotation(beam%natural, direction, motion)
         modes%mode(:, 1) = motion
      end if
      do j = 1, size(vectors, 2)
         call displace(beam, vectors(:, j), modes%mode(:, rigid + j))
      end do
      call fix_mode_signs(model%tip_dof, modes%mode)
      call describe_modes(model, modes)
   end subroutine fill_modes

end module few_modes
