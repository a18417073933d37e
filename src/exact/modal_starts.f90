!> How a motion begins, in the free modes (docs/theory.md, section 18).
module modal_starts
   use beam_loads, only: base_mass_vector, base_rotation_vector, inertia_of_curve
   use beam_model, only: beam_model_t
   use complementarity, only: solve_complementarity
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_courses, only: value_at
   use load_settings, only: field_mode, field_rotation, field_uniform, start_balance, start_drop, start_mode, &
      start_pull, start_settings_t, start_table, start_velocity
   use phase_state, only: phase_state_t
   use point_forces, only: find_point_forces, slow
   use surface_states, only: surface_state_t
   use table_starts, only: curve_of_table
   implicit none (type, external)
   private
   public :: find_modal_start, node_flexibility

   !> What is less is rounding.
   real(wp), parameter :: tolerance = 1.0e-10_wp

   !> Of so many surfaces any may carry a beam with a slow mode.
   integer, parameter :: most_carrying = 12

contains

   !> State of the free modes, and what carries the beam.
   subroutine find_modal_start(model, modes, start, several, acts, q, v, forces)
      type(beam_model_t), intent(in) :: model
      type(free_modes_t), intent(in) :: modes
      type(start_settings_t), intent(in) :: start
      !> The beam, its surfaces and the loads on it
      type(phase_state_t), intent(in) :: several
      !> Surfaces that can carry it
      logical, intent(in) :: acts(:)
      !> [modes]
      real(wp), allocatable, intent(out) :: q(:)
      real(wp), allocatable, intent(out) :: v(:)
      !> P of each surface, [surfaces]
      real(wp), intent(out) :: forces(:)

      allocate (q(size(modes%square)), v(size(modes%square)), source=0.0_wp)
      forces = 0.0_wp
      select case (start%kind)
      case (start_pull)
         associate (b => several%beam%value(:, several%pulled), square => several%beam%oscillators%square)
            q(:) = (1.0_wp + several%beam%height(several%pulled))*b &
               /(square*(sum(b**2/square) + node_flexibility(several%states(several%pulled))))
         end associate
      case (start_balance)
         call find_balance(several, acts, q, forces)
      case (start_velocity)
         select case (start%field)
         case (field_uniform)
            v(:) = start%velocity*matmul(base_mass_vector(model), modes%mode)
         case (field_rotation)
            v(:) = start%velocity*matmul(base_rotation_vector(model), modes%mode)
         case (field_mode)
            v(start%mode) = start%velocity/modes%mode(modes%tip_dof, start%mode)
         end select
      case (start_table)
         if (allocated(start%displacements)) q(:) = in_modes(start%displacements)
         if (allocated(start%velocities)) v(:) = in_modes(start%velocities)
      case (start_drop)
         v(:) = -start%velocity*matmul(base_mass_vector(model), modes%mode)
      case (start_mode)
         associate (tip => modes%mode(modes%tip_dof, start%mode))
            q(start%mode) = start%displacement/tip
            v(start%mode) = start%velocity/tip
         end associate
      end select

   contains

      !> The part of a table that the beam can take, in modes.
      function in_modes(values) result(modal)
         real(wp), intent(in) :: values(:)
         real(wp) :: modal(size(modes%square))

         real(wp) :: inertia(model%mass%order)

         inertia = inertia_of_curve(model, curve_of_table(model, start%position, values))
         modal = matmul(inertia, modes%mode)
      end function in_modes
   end subroutine find_modal_start

   !> Of a node without mass before a stop; 0: there is none.
   pure function node_flexibility(state) result(flexibility)
      type(surface_state_t), intent(in) :: state
      real(wp) :: flexibility

      flexibility = 0.0_wp
      if (state%is_node) flexibility = 1.0_wp/state%spring%stiffness
   end function node_flexibility

   !> At rest under the loads of tau = 0 on surfaces that push and never pull.
   subroutine find_balance(several, acts, q, forces)
      type(phase_state_t), intent(in) :: several
      logical, intent(in) :: acts(:)
      !> [modes]
      real(wp), intent(inout) :: q(:)
      !> [surfaces]
      real(wp), intent(inout) :: forces(:)

      real(wp), allocatable :: compliance(:, :), gap(:), force(:), load(:)
      logical, allocatable :: carries(:)
      integer, allocatable :: place(:)
      integer :: j, k

      associate (beam => several%beam, square => several%beam%oscillators%square, loads => several%loads)
         allocate (load(size(q)), source=0.0_wp)
         if (loads%count > 0) load = matmul(loads%mode, value_at(loads%course, 0.0_wp))
         allocate (place, source=pack([(k, k=1, size(acts))], acts))
         allocate (force(size(place)), source=0.0_wp)
         if (any(square < slow**2)) then
            call find_slow_balance(several, place, load, q, force)
            forces(place) = force
            return
         end if
         q = load/square
         allocate (compliance(size(place), size(place)), carries(size(place)))
         do k = 1, size(place)
            do j = 1, size(place)
               compliance(j, k) = sum(beam%value(:, place(j))*beam%value(:, place(k))/square)
            end do
            associate (state => several%states(place(k)))
               if (.not. state%is_rigid) compliance(k, k) = compliance(k, k) + 1.0_wp/state%spring%stiffness
            end associate
         end do
         allocate (gap, source=matmul(q, beam%value(:, place)) - beam%height(place))
         call solve_complementarity(compliance, gap, force, carries)
         forces(place) = force
         q = q + matmul(beam%value, forces)/square
      end associate
   end subroutine find_balance

   !> The same where a slow mode's flexibility hides the others': the one set of surfaces that carry the beam of which
   !> none pulls and no other is in the way, of the fewest.
   subroutine find_slow_balance(several, place, load, q, force)
      type(phase_state_t), intent(in) :: several
      !> Surfaces that can carry it
      integer, intent(in) :: place(:)
      !> [modes]
      real(wp), intent(in) :: load(:)
      !> [modes]
      real(wp), intent(inout) :: q(:)
      !> [place]
      real(wp), intent(inout) :: force(:)

      complex(wp), allocatable :: flexibility(:), push(:)
      complex(wp) :: z(size(load))
      real(wp) :: gap(size(place)), least, miss
      integer, allocatable :: among(:)
      integer :: k, set

      least = huge(1.0_wp)
      associate (beam => several%beam)
         do set = 0, 2**min(size(place), most_carrying) - 1
            among = pack([(k, k=1, size(place))], [(btest(set, k - 1), k=1, size(place))])
            flexibility = [(cmplx(flexibility_of(place(among(k))), 0.0_wp, wp), k=1, size(among))]
            allocate (push(size(among)))
            call find_point_forces(cmplx(beam%oscillators%square, 0.0_wp, wp), beam%value(:, place(among)), &
               flexibility, cmplx(load, 0.0_wp, wp), cmplx(beam%height(place(among)), 0.0_wp, wp), push, z)
            gap = matmul(real(z, wp), beam%value(:, place)) - beam%height(place)
            gap(among) = 0.0_wp
            ! by how much the worst one pulls, or is entered
            miss = max(0.0_wp, -minval([real(push, wp), 0.0_wp])/(sum(abs(push)) + tiny(1.0_wp)), &
               -minval([gap, 0.0_wp])/(maxval(abs(beam%height(place))) + 1.0_wp))
            if (miss < least) then
               least = miss
               q = real(z, wp)
               force = 0.0_wp
               force(among) = max(real(push, wp), 0.0_wp)
            end if
            deallocate (push)
            if (least <= tolerance) exit
         end do
      end associate

   contains

      !> Of the spring of a surface that yields.
      pure function flexibility_of(k) result(value)
         integer, intent(in) :: k
         real(wp) :: value

         value = 0.0_wp
         if (.not. several%states(k)%is_rigid) value = 1.0_wp/several%states(k)%spring%stiffness
      end function flexibility_of
   end subroutine find_slow_balance

end module modal_starts
